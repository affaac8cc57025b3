# SPDX-License-Identifier: MIT
# `make registers`: what C, Verilog and debuggers need to know of the registers, from registers.toml. Included by the top
# Makefile, which defines PYTHON, BUILD, Q and `say`.

FABRIC_GENERATE = drivers/fabric/rtl/generate.py
FABRIC_REGISTERS = $(addprefix $(BUILD)/fabric/,contract3.h mssfoc_regs.vh mssfoc.svd plant_regs.vh plant_program.vh \
    plant_addresses.h)
PLANT_RTL = drivers/fabric/rtl/plant

.PHONY: registers

registers: $(FABRIC_REGISTERS)

$(FABRIC_REGISTERS): drivers/fabric/registers.toml $(PLANT_RTL)/registers.toml $(PLANT_RTL)/microcode.py $(FABRIC_GENERATE)
	@mkdir -p $(@D)
	$(call say,GEN)
	$(Q)$(PYTHON) $(if $(filter plant_program.vh plant_addresses.h,$(@F)),$(PLANT_RTL)/microcode.py,$(FABRIC_GENERATE)) $(@F) > $@
