# SPDX-License-Identifier: MIT
# mssfoc: field-oriented motor control for the Cortex-M3 of SmartFusion2. `make help` lists the targets, with ALL=1 all.

# A user's own would send each `cd` elsewhere, and have it print where.
unexport CDPATH
ifneq ($(shell grep -l "$$(printf '\r')" .ci/alone),)
$(error mssfoc: the files here have Windows line ends, which no shell takes; a fresh git clone has none)
endif

# Motors that the image drives: as many as MOTOR names. A file's path may have blanks and brackets.
BLANK   := $() $()
comma   := ,
define NEWLINE


endef
AXES    ?= $(if $(filter 2,$(words $(MOTOR))),$(if $(wildcard $(subst $(BLANK),\ ,$(subst [,\[,$(MOTOR)))),1,2),1)
ifeq ($(filter 1 2,$(AXES)),)
$(error mssfoc: AXES='$(AXES)' is neither 1 nor 2)
endif
BUILD   ?= $(if $(filter 2,$(AXES)),build/two-axes,build)
# An absolute path to here and a relative one must name the same files, or objects are not remade when their headers change.
# Here may be a folder of any name, so no function that splits words or knows % will do.
override BUILD := $(patsubst /=%,%,$(subst /=$(CURDIR)/,/=,/=$(if $(filter environment,$(origin BUILD)),$(value BUILD),$(BUILD))))
BAD := ( ) [ ] { } < > ' " ` & | ; : , = * ? ! ~ % $$ \ \#
ifneq ($(words $(BUILD))$(strip $(foreach c,$(BAD),$(findstring $c,$(BUILD)))),1)
$(error mssfoc: BUILD='$(BUILD)' must be one folder without a blank or any of $(subst $(BLANK),,$(BAD)) in its path, like BUILD=build16)
endif
# Whatever else stands on the command line would be ignored in silence.
VARIABLES = AXES BUILD PYTHON QEMU HOSTCC HOSTCXX CROSS CC_ARM OBJCOPY AR_ARM VERILATOR SCENARIO MOTOR SEED PLANT SPREAD DETUNE FABRIC \
    SENSORS ENVM CHIP CONSOLE MODBUS CAN PROBE PORT IMAGE WRONG START BOARD DEVICE OPENOCD JLINK LIB_TRIG_FRAC PWM_HZ DEAD_TIME_NS MIN_PULSE_NS \
    SETTLE_NS FEATURES MOTORS SCENARIOS SEEDS DETUNES PART CASE WHAT ANGLES LOADS FROM JOBS SSHLOGIN ALL UNTIL N FILES BY RUNGS \
    BUDGET BUGS REMEMBER RECORDINGS V NO_INSTALL SOURCE_DATE_EPOCH
GIVEN := $(foreach v,$(.VARIABLES),$(if $(filter command,$(firstword $(origin $v))),$v))
UNKNOWN := $(firstword $(filter-out $(VARIABLES) MAKE%,$(GIVEN)))
ifneq ($(UNKNOWN),)
ALIKE := $(shell sh .ci/nearest '$(UNKNOWN)' $(VARIABLES))
$(error mssfoc: there is no variable $(UNKNOWN)$(if $(ALIKE),; did you mean $(ALIKE)=$($(UNKNOWN))?,; 'make help' has those there are$(comma) with ALL=1 the rest))
endif

PYTHON  ?= /usr/bin/python3
QEMU    ?= qemu-system-arm
HOSTCC  ?= cc
CROSS   ?= arm-none-eabi-
CC_ARM   = $(CROSS)gcc
OBJCOPY  = $(CROSS)objcopy
AR_ARM   = $(CROSS)ar

SCENARIO ?= default
MOTOR    ?=
SEED     ?= 1
PLANT    ?=
SPREAD   ?=
DETUNE   ?=
FABRIC   ?= model
SENSORS  ?=
ENVM     ?=
CHIP     ?=
CONSOLE  ?=
MODBUS   ?=
CAN      ?=
PROBE    ?=
IMAGE    ?= mssfoc
WRONG    ?=

LIB_TRIG_FRAC ?= 15

# empty: firmware/settings/rates.h has its own
PWM_HZ       ?=
DEAD_TIME_NS ?=
MIN_PULSE_NS ?=
SETTLE_NS    ?=

include firmware/settings/features.mk

CHOICES = -DLIB_TRIG_FRAC=$(LIB_TRIG_FRAC) $(PWM_HZ:%=-DCONFIG_PWM_HZ=%) $(DEAD_TIME_NS:%=-DCONFIG_DEAD_TIME_NS=%) \
          $(MIN_PULSE_NS:%=-DCONFIG_MIN_PULSE_NS=%) $(SETTLE_NS:%=-DCONFIG_SETTLE_NS=%) \
          $(FEATURES_CHOICE) $(if $(filter 2,$(AXES)),-DAXIS_COUNT=2u)

WARNINGS = -Wall -Wextra -Wconversion -Wshadow -Wundef -Wmissing-prototypes -Wstrict-prototypes -Werror
CPU      = -mcpu=cortex-m3 -mthumb
# no folder of this machine in what is built; gcc does not pass that on to the assembler, and -Wa, would split it at a comma
HERE = '$(subst ','\'',$(CURDIR))'
NO_PLACE = -ffile-prefix-map=$(HERE)=.
AS_NO_PLACE = -Xassembler --debug-prefix-map=$(HERE)=.
CFLAGS_ARM = $(CPU) -std=c11 -ffreestanding -O2 -g3 -I. $(WARNINGS) -ffunction-sections -fdata-sections \
             -fno-delete-null-pointer-checks -fno-common -fno-tree-loop-distribute-patterns \
             -fstack-usage -fcallgraph-info=su $(NO_PLACE) $(CHOICES)
LDSCRIPT = linker/m2s010.ld
LDFLAGS_ARM = $(CPU) -nostdlib -T $(LDSCRIPT) -Wl,--gc-sections -Wl,--fatal-warnings -Wl,--build-id=none
MSSFOC_IMAGE = $(BUILD)/mssfoc

# V=1 shows the commands. A quiet make shows on a terminal what it is at, in one line (.ci/alone).
Q := $(if $(V),,@)
say = $(if $(V),,$(if $(findstring s,$(firstword -$(MAKEFLAGS))),$(progress),@echo "  $1  $@"))
progress = $(if $(MSSFOC_PROGRESS),@printf '\r\033[K  %s' '$1 $(notdir $@)' >&2)

export BUILD PYTHON QEMU MOTOR SCENARIO SEED PLANT SPREAD DETUNE FABRIC SENSORS CONSOLE MODBUS CAN START ENVM CHIP PROBE PORT WRONG HOSTCC CROSS
export PYTHONDONTWRITEBYTECODE = 1

# ---- the image and the library ---------------------------------------------------------------------------------------
sources = $(sort $(wildcard $(addsuffix /*.c,$1) $(addsuffix /*.S,$1)))
objects = $(patsubst %,$(BUILD)/arm/%.o,$(basename $1))

LIB_OBJ      = $(call objects,$(call sources,lib))
PLATFORM_OBJ = $(call objects,$(call sources,startup drivers/cortex drivers/mss drivers/fabric))
FIRMWARE_OBJ = $(call objects,$(call sources,firmware firmware/settings firmware/control firmware/commission firmware/axis firmware/fault firmware/source firmware/monitor firmware/drive firmware/scope firmware/system firmware/operate))
TARGET_TESTS = $(patsubst tests/target/%.c,$(BUILD)/tests/target/%.elf,$(sort $(wildcard tests/target/test_*.c)))
HARNESS_OBJ  = $(call objects,$(filter-out $(wildcard tests/target/test_*.c),$(call sources,tests/target)))

.PHONY: all everything best-loop best-loop-twin recordings dist site guides pictures results client eds run test coverage size sizes profile lint clean help tools console debug scope page-hour flash models campaign twin target-tests
.DEFAULT_GOAL := all
.DELETE_ON_ERROR:

include linker/bounds.mk drivers/fabric/registers.mk

all: | tools-image
all: $(addprefix $(MSSFOC_IMAGE),.elf .hex .bin -envm.hex) $(BUILD)/libmssfoc.a

# Renewed when the choices are others than those the objects in BUILD were made with.
$(BUILD)/choices: FORCE
	@mkdir -p $(@D)
	@echo '$(CHOICES)' | cmp -s - $@ || echo '$(CHOICES)' > $@

# Renewed when the sources are another commit's.
$(BUILD)/commit.h: FORCE
	@mkdir -p $(@D)
	@printf '#define CONFIG_COMMIT "%-20s"\n' "$$(sh .ci/commit)" | cmp -s - $@ || printf '#define CONFIG_COMMIT "%-20s"\n' "$$(sh .ci/commit)" > $@

FORCE:

$(BUILD)/arm/%.o: %.c Makefile $(BUILD)/choices
	@mkdir -p $(@D)
	$(call say,CC)
	$(Q)$(CC_ARM) $(CFLAGS_ARM) -MMD -MP -c $< -o $@

$(BUILD)/arm/%.o: %.S Makefile $(BUILD)/choices
	@mkdir -p $(@D)
	$(call say,AS)
	$(Q)$(CC_ARM) $(CPU) -g3 -I. $(AS_NO_PLACE) $(CHOICES) -MMD -MP -c $< -o $@

# Bytes count, not cycles, except in what interrupts run each time. GCC knows no pipeline of the Cortex-M3, and that of the M4
# pairs loads as the M3's does; renamed registers let it move them together. That pays for what is in the locked cache
# (m2s010.ld). What the slow loop runs from the eNVM waits for words of code, and renamed registers need longer instructions.
CACHED = $(addprefix system/,handlers axes) drive/failover control/current_loop_frame \
    $(patsubst firmware/%.c,%,$(wildcard firmware/fault/*.c))
STEPPED = $(addprefix control/,current_loop speed_loop speed_estimate torque weakening emf oscillation profile cogging) \
    $(addprefix monitor/,supervision encoder_watch phase_watch) \
    $(addprefix drive/,drive states modes modes_control mode_speed reaction) scope/scope
in_firmware = $(addprefix $(BUILD)/arm/firmware/,$(addsuffix .o,$1))
$(BUILD)/arm/firmware/%.o: CFLAGS_ARM += -Os
$(call in_firmware,$(CACHED) $(STEPPED)): CFLAGS_ARM += -O2
$(call in_firmware,$(CACHED)): CFLAGS_ARM += -mtune=cortex-m4 -frename-registers

# the one object that knows the commit
$(BUILD)/arm/firmware/operate/commands_session.o: CFLAGS_ARM += -include $(BUILD)/commit.h
$(BUILD)/arm/firmware/operate/commands_session.o: $(BUILD)/commit.h

# the one object that knows what registers.toml says
$(BUILD)/arm/drivers/fabric/contract.o: CFLAGS_ARM += -I$(BUILD)/fabric
$(BUILD)/arm/drivers/fabric/contract.o: $(BUILD)/fabric/contract3.h

# the data sheet of a device with one motor, and with two, and the console's longer texts, packed for its image
PACKED_FROM = $(wildcard firmware/tables/*.py) firmware/settings/config.h firmware/settings/error.h \
    firmware/settings/params.h firmware/fault/fault.h $(addprefix firmware/operate/,canopen_objects.h objects.h)
$(BUILD)/packed/%/data_sheet_text.h: $(PACKED_FROM)
	@mkdir -p $(@D)
	$(call say,EDS)
	$(Q)$(PYTHON) firmware/tables/eds_packed.py $@ $*

$(BUILD)/packed/%/message_texts.h: $(PACKED_FROM) $(BUILD)/choices
	@mkdir -p $(@D)
	$(call say,TEXTS)
	$(Q)$(PYTHON) firmware/tables/messages_packed.py $@ $(FEATURES)

$(addprefix $(BUILD)/arm/firmware/operate/,canopen_sdo.o messages.o): CFLAGS_ARM += -I$(BUILD)/packed/$(AXES)
$(BUILD)/arm/firmware/operate/canopen_sdo.o: $(BUILD)/packed/$(AXES)/data_sheet_text.h
$(BUILD)/arm/firmware/operate/messages.o: $(BUILD)/packed/$(AXES)/message_texts.h

$(BUILD)/libmssfoc.a: $(LIB_OBJ)
	@rm -f $@
	$(call say,AR)
	$(Q)$(AR_ARM) rcsD $@ $^

$(MSSFOC_IMAGE).elf: $(FIRMWARE_OBJ) $(PLATFORM_OBJ) $(BUILD)/libmssfoc.a $(LDSCRIPT) $(BOUNDS_TOOLS)
	$(call say,LD)
	$(Q)$(call bounded_link,$(CC_ARM) $(LDFLAGS_ARM) -Wl$(comma)-Map=$(@:.elf=.map) $(filter %.o,$^) $(BUILD)/libmssfoc.a -lgcc)

# Libero's data-storage client counts from the start of eNVM; debug probes use the array's real address.
%.hex: %.elf
	$(call say,HEX)
	$(Q)$(OBJCOPY) -O ihex --change-section-lma '*-0x60000000' $< $@

%-envm.hex: %.elf
	$(call say,HEX)
	$(Q)$(OBJCOPY) -O ihex $< $@

%.bin: %.elf
	$(call say,HEX)
	$(Q)$(OBJCOPY) -O binary $< $@

$(BUILD)/tests/target/test_current_loop.elf: $(BUILD)/arm/firmware/system/current_loop_isr.o
$(BUILD)/tests/target/test_patience.elf: $(addprefix $(BUILD)/arm/firmware/,commission/pulses.o control/bridge.o)
$(patsubst %,$(BUILD)/tests/target/test_%.elf,dead_slow_loop new_encoder): $(filter-out %/current_loop_isr.o,$(call objects,$(call sources,$(addprefix firmware/,settings control commission axis fault source monitor drive))))

# Lib.h's assembly with other fractions, under names of its own
LIB_FRACS = $(patsubst %,$(BUILD)/arm/tests/target/frac%.o,1 16 30 31)
$(LIB_FRACS): $(BUILD)/arm/tests/target/frac%.o: lib/Lib_thumb2.S $(wildcard lib/*.h)
	@mkdir -p $(@D)
	$(Q)$(CC_ARM) $(CPU) -I. -DLIB_TRIG_FRAC=$* $(foreach f,Clarke InvClarke Park InvPark,-D$f_Lib_Do=frac$*_$f_Lib_Do) -c $< -o $@
$(BUILD)/tests/target/test_lib.elf: $(LIB_FRACS)

$(BUILD)/tests/target/%.elf: $(BUILD)/arm/tests/target/%.o $(HARNESS_OBJ) $(PLATFORM_OBJ) $(BUILD)/libmssfoc.a $(LDSCRIPT)
	@mkdir -p $(@D)
	$(call say,LD)
	$(Q)$(CC_ARM) $(LDFLAGS_ARM) $(filter %.o,$^) $(BUILD)/libmssfoc.a -lgcc -o $@

target-tests: $(TARGET_TESTS)

-include qemu/twin/twin.mk tests/bench/bench.mk tests/unit/unit.mk tests/fuzz/fuzz.mk tests/explore/explore.mk tests/swarm/swarm.mk
-include tests/prove/prove.mk tests/mutants/mutants.mk tests/fabric/fabric.mk tests/libero/libero.mk tests/bringup/bringup.mk

twin: $(BUILD)/qemu/twin.so $(if $(wildcard qemu/twin/modelcheck.c),$(BUILD)/qemu/modelcheck $(BUILD)/qemu/replay $(BUILD)/qemu/canbus)

# ---- tools -----------------------------------------------------------------------------------------------------------
# Installs what is missing of what a command uses, after saying so; NO_INSTALL=1 lists it and stops.
tools:
	@sh .ci/tools
tools-%:
	@sh .ci/tools $*

everything: all twin target-tests registers lockstep axis


# Of several makes one builds in BUILD, and the others wait for it.
ALONE = @sh .ci/alone $(BUILD)
# What a long command says first: its time on two cores, and what it leaves. README has that of the tests from here (.ci/bare).
says = @echo 'mssfoc: make $@: $(LASTS)'
test: LASTS = about 6 minutes; ALL=1, as CI has it, takes 40, ALL=2 plays everything
coverage: LASTS = some minutes: tests/unit, counted
guides: LASTS = some 7 minutes: every command in the guides
results: LASTS = about 3 minutes: every motor, every fault; writes docs/results.md and README.md
campaign: LASTS = seconds for each motor, scenario and seed, hours for all; goes on where it was ended; leaves $(BUILD)/campaign/
sizes: LASTS = some minutes: each feature left out alone, 13 builds
VERILATED = $(if $(filter rtl,$(FABRIC)),axis)
RTL_TOOLS = $(if $(filter rtl,$(FABRIC)),tools-rtl)

# ---- using it --------------------------------------------------------------------------------------------------------
run: tools-run $(RTL_TOOLS)
	$(ALONE) $(MAKE) --no-print-directory -s -j2 all twin $(VERILATED)
	@$(PYTHON) qemu/run.py run --picture

models: tools-run
	$(ALONE) $(MAKE) --no-print-directory -s -j2 twin
	@$(PYTHON) qemu/run.py models

campaign: tools-campaign
	$(says)
	$(ALONE) $(MAKE) --no-print-directory -s -j2 all twin
	@$(PYTHON) qemu/run.py campaign

scope: tools-page $(RTL_TOOLS)
	$(ALONE) $(MAKE) --no-print-directory -s -j2 all twin $(VERILATED)
	@$(PYTHON) qemu/run.py scope

page-hour: LASTS = an hour: what the page costs the processor, and how much memory it takes
page-hour: tools-browser
	$(says)
	$(ALONE) $(MAKE) --no-print-directory -s -j2 all twin
	@PAGE_S=3600 $(PYTHON) -m pytest -q -s -p no:cacheprovider tests/launcher/page_load_run.py

console debug: tools-run $(RTL_TOOLS)
	$(ALONE) $(MAKE) --no-print-directory -s -j2 all twin $(VERILATED)
	@$(PYTHON) qemu/run.py $@

flash: tools-image
	$(if $(filter mssfoc bringup,$(IMAGE)),,@echo "mssfoc: IMAGE='$(IMAGE)' is neither mssfoc nor bringup" >&2; exit 1)
	$(ALONE) $(MAKE) --no-print-directory -s -j2 $(addprefix $(BUILD)/$(IMAGE),.elf .hex -envm.hex)
	@sh .ci/flash "$(PROBE)" $(BUILD)/$(IMAGE)

test: tools-test
	$(says)
	$(ALONE) $(MAKE) --no-print-directory -s -j2 everything
	$(PYTHON) -m pytest -q -n 3 --dist load -p no:cacheprovider $(if $(filter 2,$(ALL)),,$(if $(ALL),--first,--short)) $(UNTIL:%=--until=%) tests

coverage: tools-test
	$(says)
	@$(PYTHON) tests/tools/coverage.py

lint: tools-lint
	$(ALONE) $(MAKE) --no-print-directory -s -j2 all
	@$(PYTHON) tests/tools/lint.py
	@$(PYTHON) tests/tools/arrows.py $(BUILD)/arm/firmware
	@$(PYTHON) tests/tools/writers.py

profile: tools-run
	$(ALONE) $(MAKE) --no-print-directory -s -j2 all twin
	@$(PYTHON) tests/tools/time_profile.py

size: tools-run
	$(ALONE) $(MAKE) --no-print-directory -s -j2 all
	@$(PYTHON) tests/tools/size.py $(MSSFOC_IMAGE).elf $(BUILD)/libmssfoc.a

sizes: tools-image
	$(says)
	@$(PYTHON) tests/features/builds.py

guides: tools-test
	$(says)
	$(ALONE) $(MAKE) --no-print-directory -s -j2 all twin explore-program
	@$(PYTHON) -m pytest -q -p no:cacheprovider tests/guides/guides_run.py

pictures: tools-run tools-browser
	$(ALONE) $(MAKE) --no-print-directory -s -j2 all twin
	@$(PYTHON) tests/guides/pictures.py
	@$(PYTHON) tests/launcher/page_pictures.py

compile_commands.json: tools-run
	@$(MAKE) --no-print-directory -nB all twin BUILD=$(BUILD) NO_INSTALL=1 | $(PYTHON) tests/tools/compile_commands.py $@

results: tools-run
	$(says)
	$(ALONE) $(MAKE) --no-print-directory -s -j2 all twin
	@$(PYTHON) tests/tools/results.py

# linear algebra of matrices this small gains nothing by threads
best-loop: tools-run
	@OPENBLAS_NUM_THREADS=1 $(PYTHON) tests/campaign/best_loop_page.py

best-loop-twin: LASTS = some minutes: a step of the load on 46 machines; writes tests/campaign/best_loop_twin.toml
best-loop-twin: tools-run
	$(says)
	$(ALONE) $(MAKE) --no-print-directory -s -j2 all twin
	@OPENBLAS_NUM_THREADS=1 $(PYTHON) tests/campaign/best_loop_twin.py

recordings: tools-run
	@PYTHONPATH=tests:qemu:firmware/tables:linker/bounds $(PYTHON) tests/recordings/play.py "$$RECORDINGS"

client: tools-run
	@$(PYTHON) tests/tools/client.py $(BUILD)/client

eds: tools-run
	@mkdir -p $(BUILD)
	@$(PYTHON) firmware/tables/eds.py $(BUILD)/mssfoc.eds $(AXES)
	@echo 'written: $(BUILD)/mssfoc.eds'

dist: tools-dist
	$(ALONE) $(MAKE) --no-print-directory -s -j2 all bringup-image registers
	@$(PYTHON) tests/tools/dist.py $(BUILD)

site: tools-site
	@mkdir -p $(BUILD)
	@$(PYTHON) tests/tools/site.py $(BUILD)

clean:
	rm -rf $(BUILD)

define HELP
make                  the image $(BUILD)/mssfoc.{elf,hex,bin}, $(BUILD)/mssfoc-envm.hex and $(BUILD)/libmssfoc.a
make run              run the drive in QEMU on a motor: report, picture          [MOTOR=name|file SCENARIO=name SEED=n]
make models           the motors there are, against their data sheets            [MOTOR=name|file]
make console          the console of a drive that runs in QEMU
make scope            a page in the browser: plots, captures, parameters         [PORT=/dev/ttyUSB0, of a board]
make campaign         motors x scenarios x seeds, the worst cases in a table     [MOTORS="a b" SCENARIOS="a b" SEEDS=n]
make test             the tests
make client           the Python client of a drive, $(BUILD)/client
make eds              the electronic data sheet of a drive on CAN, $(BUILD)/mssfoc.eds
make libero           a Libero project for a board                               [BOARD=creative|sk1 IMAGE=bringup]
make bringup          the image that tells what a device is, in QEMU
make flash PROBE=p    onto a board, p is openocd or jlink                        [IMAGE=bringup, instead of the drive]
make dist             all that a user takes home, in one archive in $(BUILD)/dist/
make clean            remove $(BUILD)
endef

define HELP_ALL

of make run, console, scope and debug
  MOTOR="a b" SCENARIO="x y"   two motors on one core; AXES=2 an image for two, in build/two-axes (docs/two-axes.md)
  PLANT=full|ideal|rtl|full,-effect... SPREAD=factor DETUNE="parameter*1.3 ..."     the plant (docs/plant.md, docs/motors.md)
  FABRIC=model|rtl             C models, or the RTL, verilated, in their place (docs/fabric.md)
  SENSORS=amc1306              isolated modulators instead of the converters; with FABRIC=rtl
  START=found|aligned          the drive finds where its rotor stands, or knows it
  ENVM=file                    what the device keeps: settings that `save` has written (docs/settings.md)
  CHIP=m2s010|m2s025           on the smaller one traffic on FIC_0 undoes changes (docs/silicon.md)
  CONSOLE=pty|tcp:PORT         the console for a program instead of this terminal (docs/client.md)
  MODBUS=pty|tcp:PORT          its Modbus, for mbpoll, pymodbus or a PLC (docs/modbus.md)
  CAN=tcp:PORT|pty|join:PORT   its CAN bus, for programs that speak socketcand or slcan; join: one more drive (docs/can.md)
  QEMU=path                    another QEMU
of make campaign (docs/campaign.md)
  MOTORS="a b.toml lot:1-200" SCENARIOS="a b" SEEDS=n DETUNES="x*1.3;y*0.8" JOBS=n SSHLOGIN=hosts
  PART=start                   from every angle, under load     [ANGLES="0 90" LOADS="free hoist20 friction20"]
  PART=wiring                  what is connected or told wrongly is named
  PART=supervision             what goes wrong while it turns is found in time; stops without a sink
  PART=detune                  told wrong R, L, flux, J it still works
  PART=identify                what the drive finds out about its motor, against the plant
  PART=identified              the default scenario by what it has found out, against nominal values
  PART=sensorless              without an encoder: starts, a rotor that turns already, a rotor lost on purpose
  PART=lot                     motors by lot, five cases each: how many are wrong    [FROM=1 N=200]
  PART=saliency                by injection: lock at standstill, rated torque at standstill
  WHAT="swap_* locked"         these cases of a part only
  CASE="start:teknic_m2310p/hoist20/45"   one case of a part, with its trace
of every build
  FEATURES="a b"               an image of these alone, of $(FEATURES_ALL)
  PWM_HZ=n DEAD_TIME_NS=n MIN_PULSE_NS=n SETTLE_NS=n   another rate, 8000...40000, dead time, pulse, amplifier (firmware/settings/rates.h)
  LIB_TRIG_FRAC=n              the library for cosines and sines of n fraction bits, 1...31 (docs/library.md)
  BUILD=dir                    puts every product elsewhere; PYTHON=path chooses the interpreter, V=1 shows the commands
more tests
  make test ALL=1|2            every test, as CI has them; every case of each   [CHIP=name QEMU=path]
  make fuzz                    what comes in by console, Modbus, CANopen and eNVM, changed towards what it has not entered [N=runs]
  make coverage                lines and branches of the firmware that no unit test enters
  make prove                   every kernel and the interrupt, as assembled, for all inputs, by a solver
  make explore                 every state of the drive that requests, faults, timers and interrupts lead to, and what must hold in it
  make swarm                   masters, faults, power cuts by lot, on the drive's own code; what is wrong, shrunk   [N=count SEED=text BUGS=1]
  make fabric                  the RTL: lint in three tools, proofs by induction, faults that they must refute, cells and levels
  make guides                  what docs/guides tell the reader to type: all of it runs, and the drive answers so
  make mutants                 mistakes put into drive and plant: what share is noticed [N=count SEED=text FILES="globs" BY=file PART=k/n JOBS=n RUNGS="names"]
  make bringup WRONG=name      a device made otherwise, of qemu/chips/wrong.toml
  make lint                    formatting, warnings, layers
figures
  make results                 the measured figures into docs/results.md and README.md, and README.md's picture
  make best-loop               what the best speed loop of a machine can do at a rate and lag, docs/best-loop.md
  make best-loop-twin          what the twin measures of today's, which that page compares     [MOTORS="a lot:1-9"]
  make recordings              Hall edges of real motors through the drive's estimate, and how far it is off  [RECORDINGS=folder]
  make bench                   cycles of every function and of the current loop, docs/benchmarks.md, build/cycles.md
  make profile                 where the time of a run goes, by perf                        [MOTOR= SCENARIO= PLANT=]
  make size                    flash and RAM by room; flash, RAM and stack of each function of the library
  make sizes                   what each feature costs: an image without it
  make timing                  the cycle model against hand-counted and published cases
  make wcet                    worst-case cycles of the current loop, and measured
  make jitter                  cycles and start of each current-loop interrupt
  make stack                   worst-case stack of every entry point, and measured
for developers
  make debug                   QEMU halted, with a GDB port
  make compile_commands.json   how each file is compiled, for editors
  make registers               the fabric's registers for C, Verilog and debuggers, into $(BUILD)/fabric/
  make site                    the documents as pages with a search, build/site/index.html
  make pictures                those of docs/guides/tuning.md and of the page in the browser, which README shows moving
  make page-hour               an hour of that page: what it costs the processor, and how much memory it takes
  make tools                   install what is missing (NO_INSTALL=1: only list it)
endef

help:
	@: $(info $(HELP)$(if $(ALL),$(HELP_ALL),$(NEWLINE)make help ALL=1       the rest: what each of them takes, more tests, figures))

# A misspelt target is said before any other one is begun. What --eval defines stands in no file.
ifeq ($(findstring --eval,$(MAKEFLAGS)),)
TARGETS := $(shell sed -n 's/^\([a-z][a-z0-9_.% -]*\):\([^=].*\)*$$/\1/p' Makefile $(filter %.mk,$(MAKEFILE_LIST)))
NO_TARGET := $(firstword $(foreach goal,$(MAKECMDGOALS),$(if $(findstring /,$(goal)),,$(filter-out $(TARGETS),$(goal)))))
ifneq ($(NO_TARGET),)
ALIKE := $(shell sh .ci/nearest '$(subst ','\'',$(NO_TARGET))' $(TARGETS))
$(error mssfoc: there is no target $(NO_TARGET)$(if $(ALIKE),; did you mean make $(ALIKE)?,; 'make help' has those there are$(comma) with ALL=1 the rest))
endif
endif

-include $(shell find $(BUILD)/arm -name '*.d' 2>/dev/null)
