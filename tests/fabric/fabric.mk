# SPDX-License-Identifier: MIT
# `make fabric`: the RTL in drivers/fabric/rtl, checked, proved, attacked and counted: docs/fabric.md. `make registers`: what
# C, Verilog and debuggers need to know of the registers. Included by the top Makefile, which defines PYTHON, BUILD and `say`.

FABRIC_GENERATE = drivers/fabric/rtl/generate.py
FABRIC_REGISTERS = $(addprefix $(BUILD)/fabric/,contract3.h mssfoc_regs.vh mssfoc.svd)
FABRIC_STEPS = fabric-stale fabric-lint fabric-synthesis fabric-proofs fabric-benches fabric-mutants

registers: $(FABRIC_REGISTERS)

$(FABRIC_REGISTERS): drivers/fabric/registers.toml $(FABRIC_GENERATE)
	@mkdir -p $(@D)
	$(call say,GEN)
	$(Q)$(PYTHON) $(FABRIC_GENERATE) $(@F) > $@

# All steps run, whatever the others say; one that fails makes the whole fail.
fabric: tools
	@$(MAKE) --no-print-directory -s -k $(FABRIC_STEPS)

fabric-stale:
	@$(PYTHON) $(FABRIC_GENERATE) --check && echo 'registers: the tables of docs/fabric.md are up to date'

fabric-lint fabric-synthesis fabric-proofs fabric-benches fabric-mutants: registers

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

.PHONY: fabric registers $(FABRIC_STEPS)
