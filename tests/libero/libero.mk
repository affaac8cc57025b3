# SPDX-License-Identifier: MIT
# `make libero BOARD=name`: a Libero project as Tcl in $(BUILD)/libero/name, checked: docs/libero.md. Included by the top
# Makefile, which defines PYTHON, BUILD and ALONE.

BOARD ?=
LIBERO = PYTHONPATH=drivers/fabric $(PYTHON) -m libero '$(BOARD)'

libero: tools-libero
	@$(LIBERO)
	$(ALONE) $(MAKE) --no-print-directory -s -j2 all registers
	@$(LIBERO) $(BUILD)
	@$(PYTHON) tests/libero/check.py '$(BOARD)' $(BUILD)/libero/$(BOARD)

.PHONY: libero
