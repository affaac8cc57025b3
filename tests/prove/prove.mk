# SPDX-License-Identifier: MIT
# `make prove`: the assembled kernels against their specifications. Included by the top Makefile, which defines BUILD,
# CFLAGS_ARM, Q and say.

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

prove: tools
	@$(MAKE) --no-print-directory -s -j2 prove-objects $(BUILD)/prove/sweep_root
	@$(BUILD)/prove/sweep_root
	@$(PYTHON) tests/prove/prove.py $(BUILD)/libmssfoc.a $(BUILD)/prove/kernels.o $(BUILD)/prove

.PHONY: prove prove-objects

-include $(wildcard $(BUILD)/prove/*.d)
