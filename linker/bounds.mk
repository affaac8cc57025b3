# SPDX-License-Identifier: MIT
# The bounds that are worked out of the linked image. Included by the top Makefile, which defines BUILD, PYTHON, Q, say
# and LINK_IMAGE, the command that links the image (without -o).

# $(call bounded_link,COMMAND): links $@ twice. The stack bounds come from the first image; the second link is told, and
# the linker script refuses what does not fit. Only symbols differ between the two.
bounded_link = $1 -o $@.draft && options=$$($(PYTHON) linker/bounds/stack.py --linker $@.draft $(BUILD)/arm) && \
    $1 $$options -o $@ && rm -f $@.draft

.PHONY: wcet jitter

stack: tools-run
	$(ALONE) $(MAKE) --no-print-directory -s -j2 all twin
	@PYTHONPATH=tests/tools $(PYTHON) linker/bounds/stack.py --measure $(MSSFOC_IMAGE).elf $(BUILD)/arm

# The bounds of the current loop's cycles beside what two runs measured: everything it does, and a fault that it finds.
wcet: tools-run
	$(ALONE) $(MAKE) --no-print-directory -s -j2 all twin
	@$(PYTHON) qemu/run.py run --scenario default --out $(BUILD)/wcet >/dev/null
	@$(PYTHON) qemu/run.py run --scenario fault_overcurrent --out $(BUILD)/wcet/fault >/dev/null
	@$(PYTHON) tests/tools/wcet.py $(MSSFOC_IMAGE).elf $(BUILD)/wcet/irq.bin $(BUILD)/wcet/fault/irq.bin

jitter: tools-run
	$(ALONE) $(MAKE) --no-print-directory -s -j2 all twin
	@$(PYTHON) tests/tools/jitter.py
