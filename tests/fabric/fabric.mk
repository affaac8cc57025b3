# SPDX-License-Identifier: MIT
# `make fabric`: the RTL in drivers/fabric/rtl, checked, proved, attacked and counted: docs/fabric3.md. Included by the top
# Makefile, which defines PYTHON.

FABRIC_STEPS = fabric-stale fabric-lint fabric-synthesis fabric-proofs fabric-benches fabric-mutants

# All steps run, whatever the others say; one that fails makes the whole fail.
fabric: tools
	@$(MAKE) --no-print-directory -s -k $(FABRIC_STEPS)

fabric-stale:
	@$(PYTHON) drivers/fabric/rtl/generate.py --check && echo 'registers: nothing is stale'

fabric-lint:
	@$(PYTHON) tests/fabric/lint.py

fabric-synthesis:
	@$(PYTHON) tests/fabric/synthesis.py

fabric-proofs:
	@$(PYTHON) tests/fabric/prove.py

fabric-benches:
	@$(PYTHON) tests/fabric/adc_benches.py && $(PYTHON) tests/fabric/adc_benches.py --faults

fabric-mutants:
	@$(PYTHON) tests/fabric/mutate.py

.PHONY: fabric $(FABRIC_STEPS)
