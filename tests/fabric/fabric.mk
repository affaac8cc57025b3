# SPDX-License-Identifier: MIT
# `make fabric`: the RTL in drivers/fabric/rtl, checked, proved, attacked and counted: docs/fabric.md. Included by
# the top Makefile, which defines PYTHON, BUILD and `say`.

FABRIC_STEPS = fabric-stale fabric-lint fabric-synthesis fabric-netlist fabric-proofs fabric-benches fabric-lockstep \
    fabric-plant fabric-mutants
FABRIC_RTL = $(wildcard drivers/fabric/rtl/*.v)

HOSTCXX ?= g++
VERILATOR ?= verilator
VERILATE = $(VERILATOR) --cc -O3 -Wall --x-assign fast --x-initial fast --language 1364-2005 -Idrivers/fabric/rtl \
    -I$(BUILD)/fabric --top-module fabric_axis drivers/fabric/rtl/fabric_axis.v
VERILATED_INCLUDE = $(shell $(VERILATOR) --getenv VERILATOR_ROOT)/include
HOST_WARNINGS = -Wall -Wextra -Wshadow -Werror

# All steps run, whatever the others say; one that fails makes the whole fail.
fabric: LASTS = some 11 minutes: lint, synthesis, proofs, benches, lockstep, mutants; REMEMBER=1: and CI knows
fabric: tools-fabric
	$(says)
	@$(MAKE) --no-print-directory -s -k $(FABRIC_STEPS)
	$(if $(REMEMBER),@$(PYTHON) tests/tools/passed.py fabric --remember)

fabric-stale:
	@$(PYTHON) $(FABRIC_GENERATE) --check && echo 'registers: the tables of docs/fabric.md are up to date'

fabric-lint fabric-synthesis fabric-netlist fabric-proofs fabric-benches fabric-mutants: registers

fabric-lint:
	@$(PYTHON) tests/fabric/lint.py

fabric-synthesis:
	@$(PYTHON) tests/fabric/synthesis.py

fabric-netlist:
	@$(PYTHON) tests/fabric/netlist.py && $(PYTHON) tests/fabric/netlist.py --faults

fabric-proofs:
	@$(PYTHON) tests/fabric/prove.py

# the RTL that `make run FABRIC=rtl` puts into the twin; lean: no coverage, no tracing
PLANT_DIR ?= $(BUILD)/fabric/plant
AXIS_SOURCES = $(addprefix qemu/twin/,rtl_axis.cpp rtl_glide.cpp rtl_filters.cpp rtl_look.cpp)
AXIS_HEADERS = $(addprefix qemu/twin/,rtl_axis.h rtl_names.h rtl_axis.vlt rtl_motor.cpp rtl_no_motor.cpp \
    rtl_plant.h)

# and for drivers with an input and an enable for each leg
$(BUILD)/fabric/axis.so: IN_EN = 0
$(BUILD)/fabric/axis_in_en.so: IN_EN = 1
# with a motor in RTL at its pins
$(BUILD)/fabric/axis_plant.so: IN_EN = 0
AXIS = $(BUILD)/fabric/$*
AXIS_NEEDS = $(FABRIC_RTL) $(FABRIC_REGISTERS) $(AXIS_SOURCES) $(AXIS_HEADERS) tests/fabric/fabric.mk

$(BUILD)/fabric/axis.so $(BUILD)/fabric/axis_in_en.so: AXIS_END = qemu/twin/rtl_no_motor.cpp
$(BUILD)/fabric/axis_plant.so: AXIS_END = qemu/twin/rtl_motor.cpp $(PLANT_DIR)/rtl_plant.o $(PLANT_DIR)/Vplant__ALL.a
$(BUILD)/fabric/axis_plant.so: $(PLANT_DIR)/plant.a
AXES_OF_RTL = $(addprefix $(BUILD)/fabric/,axis.so axis_in_en.so axis_plant.so)
$(AXES_OF_RTL): $(BUILD)/fabric/%.so: $(AXIS_NEEDS)
	@mkdir -p $(AXIS)
	$(call say,VERILATE)
	$(Q)$(VERILATE) -GIN_EN=$(IN_EN) qemu/twin/rtl_axis.vlt --Mdir $(AXIS) > /dev/null
	$(Q)$(MAKE) -s -C $(AXIS) -f Vfabric_axis.mk OPT_FAST='-O3 -fPIC' OPT_SLOW='-O1 -fPIC' OPT_GLOBAL='-O2 -fPIC' \
	    Vfabric_axis__ALL.a verilated.o verilated_threads.o > $(AXIS)/log 2>&1 || { tail -n 5 $(AXIS)/log; exit 1; }
	$(Q)$(HOSTCXX) -std=c++17 -DIN_EN=$(IN_EN) -O3 -fPIC -shared $(HOST_WARNINGS) -Iqemu/twin -I$(AXIS) \
	    -isystem $(VERILATED_INCLUDE) -isystem $(VERILATED_INCLUDE)/vltstd $(AXIS_SOURCES) $(AXIS_END) \
	    $(AXIS)/Vfabric_axis__ALL.a $(AXIS)/verilated.o $(AXIS)/verilated_threads.o -o $@ -lpthread

axis: $(AXES_OF_RTL)

LOCKSTEP = $(BUILD)/fabric/lockstep
LOCKSTEP_MODELS = pwm adc encoder gate sto chopper watch fabric_model
LOCKSTEP_SOURCES = $(wildcard tests/fabric/lockstep/*.cpp)

# of axis 0, and of one that follows it and drives inputs and enables; filters and patience of safe torque off as short as a run
LOCKSTEP_STO = -GSTO_TEST=60 -GSTO_APART=300
$(LOCKSTEP)/rtl1.a: RTL_AXIS = -GAXIS=1 -GAXES=2 -GIN_EN=1
$(LOCKSTEP)/rtl.a $(LOCKSTEP)/rtl1.a: $(LOCKSTEP)/%.a: $(FABRIC_RTL) $(FABRIC_REGISTERS) tests/fabric/fabric.mk
	@mkdir -p $(@D)
	$(call say,VERILATE)
	$(Q)$(VERILATE) $(RTL_AXIS) $(LOCKSTEP_STO) --coverage-line --Mdir $(@D)/$* > /dev/null
	$(Q)$(MAKE) -s -C $(@D)/$* -f Vfabric_axis.mk OPT_FAST=-O2 OPT_SLOW=-O1 Vfabric_axis__ALL.a verilated.o \
	    verilated_cov.o verilated_threads.o > $(@D)/$*.log 2>&1 || { tail -n 5 $(@D)/$*.log; exit 1; }
	@rm -f $@
	$(Q)ar rcs $@ $(@D)/$*/*.o

# not the twin's objects: those wait for link-time optimisation by its own compiler
$(LOCKSTEP)/%.o: qemu/twin/%.c $(wildcard qemu/twin/*.h) tests/fabric/fabric.mk
	@mkdir -p $(@D)
	$(call say,CC)
	$(Q)$(HOSTCC) -std=gnu11 -O2 $(HOST_WARNINGS) -I$(BUILD)/fabric -c $< -o $@

LOCKSTEPS = $(LOCKSTEP)/lockstep $(LOCKSTEP)/lockstep1

$(LOCKSTEPS): $(LOCKSTEP_SOURCES) $(wildcard tests/fabric/lockstep/*.h)
$(LOCKSTEP)/lockstep1: LOCKSTEP_AXIS = 1
$(LOCKSTEPS): $(LOCKSTEP)/lockstep%: $(LOCKSTEP_MODELS:%=$(LOCKSTEP)/%.o) $(LOCKSTEP)/rtl%.a
	$(call say,LD)
	$(Q)$(HOSTCXX) -std=c++17 -O2 $(HOST_WARNINGS) -Iqemu/twin -I$(LOCKSTEP)/rtl$* -isystem $(VERILATED_INCLUDE) \
	    -DVM_COVERAGE=1 $(LOCKSTEP_STO:-G%=-D%) $(LOCKSTEP_AXIS:%=-DAXIS=%) $(LOCKSTEP_SOURCES) $(filter %.o %.a,$^) \
	    -o $@ -lm -lpthread

lockstep: $(LOCKSTEPS)

fabric-lockstep: $(LOCKSTEPS)
	@$(PYTHON) tests/fabric/lockstep.py $< 10000000 && $(PYTHON) tests/fabric/lockstep.py $(LOCKSTEP)/lockstep1 10000000

fabric-benches:
	@$(PYTHON) tests/fabric/adc_benches.py && $(PYTHON) tests/fabric/adc_benches.py --faults

fabric-mutants:
	@$(PYTHON) tests/fabric/mutate.py

lockstep: $(PLANT_DIR)/plant.so $(PLANT_DIR)/lockstep

fabric-plant: $(PLANT_DIR)/plant.so $(PLANT_DIR)/lockstep
	@$(PYTHON) tests/fabric/plant_exact.py && $(PYTHON) tests/fabric/plant_lockstep.py && \
	    $(PYTHON) tests/fabric/plant_exact.py --faults

.PHONY: fabric registers lockstep axis $(FABRIC_STEPS)

# the plant in RTL, alone: for its benches and for the lockstep with the C plant
PLANT_FROM ?= $(PLANT_RTL)
PLANT_SOURCES = $(wildcard $(PLANT_FROM)/*.v) $(FABRIC_REGISTERS)
PLANT_VERILATE = $(VERILATOR) --cc -O3 -Wall --x-assign fast --x-initial fast --noassert --language 1364-2005 \
    -I$(PLANT_FROM) -I$(BUILD)/fabric --top-module plant $(PLANT_FROM)/plant.v qemu/twin/rtl_plant.vlt
PLANT_CXX = $(HOSTCXX) -std=c++17 -O3 -fPIC $(HOST_WARNINGS) -Iqemu/twin -I$(PLANT_DIR) -isystem $(VERILATED_INCLUDE) \
    -isystem $(VERILATED_INCLUDE)/vltstd

RTL_PLANT = $(addprefix qemu/twin/rtl_plant,.cpp .h .vlt)
$(PLANT_DIR)/plant.a: $(PLANT_SOURCES) $(RTL_PLANT) tests/fabric/fabric.mk
	@mkdir -p $(@D)
	$(call say,VERILATE)
	$(Q)$(PLANT_VERILATE) --Mdir $(@D) > /dev/null
	$(Q)$(MAKE) -s -C $(@D) -f Vplant.mk OPT_FAST='-O3 -fPIC' OPT_SLOW='-O1 -fPIC' OPT_GLOBAL='-O2 -fPIC' \
	    Vplant__ALL.a verilated.o verilated_threads.o > $(@D)/log 2>&1 || { tail -n 5 $(@D)/log; exit 1; }
	$(Q)$(PLANT_CXX) -c qemu/twin/rtl_plant.cpp -o $(@D)/rtl_plant.o
	@rm -f $@
	$(Q)ar rcs $@ $(@D)/*.o

$(PLANT_DIR)/plant.so: $(PLANT_DIR)/plant.a
	$(Q)$(HOSTCXX) -shared -Wl,--whole-archive $< -Wl,--no-whole-archive -lpthread -o $@

# against the C plant: its physics, what makes words of its parameters, and the plant in RTL
PLANT_LOCKSTEP_OBJECTS = $(patsubst %,$(LOCKSTEP)/%.o,$(TWIN_PHYSICS) plant_words)
$(PLANT_DIR)/lockstep: tests/fabric/plant/lockstep.c $(PLANT_LOCKSTEP_OBJECTS) $(PLANT_DIR)/plant.a
	$(call say,LD)
	$(Q)$(HOSTCC) -std=gnu11 -O2 $(HOST_WARNINGS) -Iqemu/twin -I$(BUILD)/fabric -c $< -o $(LOCKSTEP)/plant_main.o
	$(Q)$(HOSTCXX) $(LOCKSTEP)/plant_main.o $(PLANT_LOCKSTEP_OBJECTS) $(PLANT_DIR)/plant.a -lm -lpthread -o $@
