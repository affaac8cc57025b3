# SPDX-License-Identifier: MIT
# The firmware's rooms as shared libraries of this machine, for tests/unit: every undefined behaviour is trapped, registers are
# structures in the test's memory, the core and the console are tests/unit/host. Included by the top Makefile, which defines
# BUILD, HOSTCC, Q and say.

# tests/tools/coverage.py has it count instead
UNIT_WATCHED ?= -fsanitize=undefined -fno-sanitize-recover=all
UNIT_CFLAGS := -std=gnu11 -O1 -g -fPIC $(UNIT_WATCHED) \
    -fsanitize-coverage=trace-pc -fno-inline \
    -Wall -Wextra -Werror \
    -Wno-int-to-pointer-cast -Itests/unit/host -I.

unit_objects = $(patsubst %.c,$(BUILD)/host/%.o,$(sort $(wildcard $1)))

# the rooms below the console; of what the fabric's drivers hold, contract.c only checks
UNIT_SRC := $(filter-out %/device.c %/contract.c, \
    $(wildcard $(addprefix firmware/,$(addsuffix /*.c,axis settings control fault commission source monitor drive scope)) \
    drivers/fabric/*.c lib/*.c)) \
    drivers/mss/envm.c qemu/twin/envm.c qemu/twin/random.c tests/unit/host/envm.c
# the console on a person's side, and on the device's what stands at registers' own addresses
UNIT_FIRMWARE := $(call unit_objects,$(UNIT_SRC) firmware/operate/*.c tests/unit/host/*.c)
UNIT_SYSTEM := $(call unit_objects,$(UNIT_SRC) firmware/system/*.c firmware/monitor/device.c drivers/mss/sysreg.c \
    $(addprefix drivers/mss/,cache.c can.c timer.c gpio.c mmuart.c rs485.c) \
    $(addprefix tests/unit/host/,interrupt.c system/*.c))

unit: $(addprefix $(BUILD)/tests/unit/,firmware.so system.so two_axes.so two_axes_buses.so)
.PHONY: unit
everything: unit

$(BUILD)/tests/unit/firmware.so: $(UNIT_FIRMWARE)
$(BUILD)/tests/unit/system.so: $(UNIT_SYSTEM)
# what names AXIS_COUNT is made again, for two motors
for_two = $(patsubst $(BUILD)/host/firmware/$1/%,$(BUILD)/host/two_axes/$1/%,$2)
$(BUILD)/tests/unit/two_axes.so: $(call for_two,system,$(UNIT_SYSTEM))
$(BUILD)/tests/unit/two_axes_buses.so: $(call for_two,operate,$(UNIT_FIRMWARE))
$(BUILD)/tests/unit/%.so: tests/unit/unit.mk
	@mkdir -p $(@D)
	$(call say,LD)
	$(Q)$(HOSTCC) -shared $(UNIT_WATCHED) $(filter %.o,$^) -lm -o $@

$(BUILD)/host/%.o: %.c tests/unit/unit.mk
	@mkdir -p $(@D)
	$(call say,HOSTCC)
	$(Q)$(HOSTCC) $(UNIT_CFLAGS) -MMD -MP -c $< -o $@

$(BUILD)/host/two_axes/%.o: firmware/%.c tests/unit/unit.mk
	@mkdir -p $(@D)
	$(call say,HOSTCC)
	$(Q)$(HOSTCC) $(UNIT_CFLAGS) -DAXIS_COUNT=2u -DSCOPE_WORDS=4096u -MMD -MP -c $< -o $@

# what is packed for one motor's drive, and for two's
$(addprefix $(BUILD)/host/firmware/operate/,canopen_sdo.o messages.o): UNIT_CFLAGS += -I$(BUILD)/packed/1
$(BUILD)/host/firmware/operate/canopen_sdo.o: $(BUILD)/packed/1/data_sheet_text.h
$(BUILD)/host/firmware/operate/messages.o: $(BUILD)/packed/1/message_texts.h
$(addprefix $(BUILD)/host/two_axes/operate/,canopen_sdo.o messages.o): UNIT_CFLAGS += -I$(BUILD)/packed/2
$(BUILD)/host/two_axes/operate/canopen_sdo.o: $(BUILD)/packed/2/data_sheet_text.h
$(BUILD)/host/two_axes/operate/messages.o: $(BUILD)/packed/2/message_texts.h

-include $(shell find $(BUILD)/host -name '*.d' 2>/dev/null)
