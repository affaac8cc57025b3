# SPDX-License-Identifier: MIT
# `make prove`: the assembled kernels against their specifications, and the current loop's interrupt as a whole. Included by the
# top Makefile, which defines BUILD, CFLAGS_ARM, CHOICES, MSSFOC_IMAGE, Q and say.

PROVE_FRACS = 1 16 30 31

$(BUILD)/prove/kernels.o: tests/prove/kernels.c Makefile
	@mkdir -p $(@D)
	$(call say,CC)
	$(Q)$(CC_ARM) $(CFLAGS_ARM) -MMD -MP -c $< -o $@

prove-objects: $(BUILD)/libmssfoc.a $(BUILD)/prove/kernels.o
	@for frac in $(PROVE_FRACS); do \
	    $(MAKE) --no-print-directory -s BUILD=$(BUILD)/prove/$$frac LIB_TRIG_FRAC=$$frac \
	        $(BUILD)/prove/$$frac/libmssfoc.a || exit 1; \
	done

# what is no kernel, but small enough to be tried out: the root of every square
$(BUILD)/prove/sweep_root: tests/lib/sweep_root.c $(wildcard lib/*.[ch])
	@mkdir -p $(@D)
	$(call say,HOSTCC)
	$(Q)$(HOSTCC) -std=c11 -O2 -Wall -Wextra -Werror -I. tests/lib/sweep_root.c lib/polar.c -o $@

# what the interrupt's proof takes as given, from the firmware's own tuning and slow loop
ADMITTED_SRC = tests/prove/admitted.c $(addprefix firmware/control/,bridge.c current_loop.c) \
               $(wildcard firmware/settings/*.c lib/*.c) $(filter-out %/contract.c,$(wildcard drivers/fabric/*.c))

$(BUILD)/prove/admitted: $(ADMITTED_SRC) $(wildcard firmware/*/*.h drivers/*/*.h lib/*.h) $(BUILD)/choices
	@mkdir -p $(@D)
	$(call say,HOSTCC)
	$(Q)$(HOSTCC) -std=gnu11 -O2 -Wall -Wextra -Werror -Wno-int-to-pointer-cast $(CHOICES) -Itests/unit/host -I. \
	    $(ADMITTED_SRC) -o $@

# in `everything`, so that no two tests that need it make it at once
everything: interrupt-objects
interrupt-objects: $(MSSFOC_IMAGE).elf $(BUILD)/prove/admitted

PROVE_INTERRUPT = $(PYTHON) tests/prove/prove_interrupt.py $(MSSFOC_IMAGE).elf $(BUILD)/prove/admitted

prove: LASTS = some minutes: every kernel, the whole interrupt; REMEMBER=1: and CI knows
prove: tools-prove
	$(says)
	$(ALONE) $(MAKE) --no-print-directory -s -j2 prove-objects interrupt-objects $(BUILD)/prove/sweep_root
	@$(BUILD)/prove/sweep_root
	@$(PROVE_INTERRUPT) 1000000 4
	@$(PYTHON) tests/prove/prove.py $(BUILD)/libmssfoc.a $(BUILD)/prove/kernels.o $(BUILD)/prove
	$(if $(REMEMBER),@$(PYTHON) tests/tools/passed.py prove --remember)

.PHONY: prove prove-objects interrupt-objects

-include $(wildcard $(BUILD)/prove/*.d)
