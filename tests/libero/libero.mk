# SPDX-License-Identifier: MIT
# `make libero BOARD=name [IMAGE=bringup]`: a Libero project as Tcl in $(BUILD)/libero/name, checked: docs/libero.md. Included
# by the top Makefile, which defines PYTHON, BUILD, ALONE and IMAGE.

BOARD ?=
LIBERO = PYTHONPATH=drivers/fabric $(PYTHON) -m libero '$(BOARD)'

libero: tools-libero
	@$(LIBERO)
	$(ALONE) $(MAKE) --no-print-directory -s -j2 all registers $(if $(filter bringup,$(IMAGE)),bringup-image)
	@$(LIBERO) $(BUILD) $(IMAGE)
	@$(PYTHON) tests/libero/check.py '$(BOARD)' $(BUILD)/libero/$(BOARD)

.PHONY: libero
