# SPDX-License-Identifier: MIT
# `make swarm`: histories by lot, played on the drive's own code (docs/guides/code.md). Included by the top Makefile, behind
# unit.mk, which builds the drive.

SWARM_SRC := $(wildcard tests/swarm/*.c) tests/explore/judge.c
SWARM_CFLAGS := -std=gnu11 -O2 -g -ffp-contract=off -Wall -Wextra -Werror -Wno-int-to-pointer-cast \
    -Itests/unit/host -Itests/swarm -I.

swarm-program: $(BUILD)/swarm/swarm1 $(BUILD)/swarm/swarm2
.PHONY: swarm swarm-program
everything: swarm-program

$(BUILD)/swarm/swarm1: $(BUILD)/tests/unit/firmware.so
$(BUILD)/swarm/swarm2: $(BUILD)/tests/unit/two_axes_buses.so
$(BUILD)/swarm/swarm2: SWARM_CFLAGS += -DAXIS_COUNT=2u -DSCOPE_WORDS=4096u
$(BUILD)/swarm/swarm%: $(SWARM_SRC) tests/swarm/swarm.h tests/explore/judge.h tests/swarm/swarm.mk
	@mkdir -p $(@D)
	$(call say,HOSTCC)
	$(Q)$(HOSTCC) $(SWARM_CFLAGS) $(SWARM_SRC) $(filter %.so,$^) -ldl -o $@

swarm: LASTS = N=20000 half an hour of a core; what is wrong is shrunk to the fewest events, printed as a history to play again
swarm: tools-explore
	$(says)
	$(ALONE) $(MAKE) --no-print-directory -s -j2 swarm-program
	@PYTHONPATH=tests $(PYTHON) -m $(if $(BUGS),swarm.bugs,swarm.play run) $(or $(SEED),1) $(if $(BUGS),,$(or $(N),1000))
