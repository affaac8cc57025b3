# SPDX-License-Identifier: MIT
# The bounds that are worked out of the linked image. Included by the top Makefile, which defines BUILD, PYTHON, Q, say
# and LINK_IMAGE, the command that links the image (without -o).

# $(call bounded_link,COMMAND): links $@ twice. The stack bounds come from the first image; the second link is told, and
# the linker script refuses what does not fit. Only symbols differ between the two.
BOUNDS_TOOLS := $(addprefix tests/tools/,stack.py crosscheck.py disasm.py entries.py frames.py)
bounded_link = $1 -o $@.draft && options=$$($(PYTHON) tests/tools/stack.py --linker $@.draft $(BUILD)/arm) && \
    $1 $$options -o $@ && rm -f $@.draft

.PHONY: wcet jitter

stack: tools
	@$(MAKE) --no-print-directory -s -j2 all twin
	@$(PYTHON) tests/tools/stack.py --measure $(MSSFOC_IMAGE).elf $(BUILD)/arm
