# SPDX-License-Identifier: MIT
# What the image has: FEATURES="..." out of the list in features.h, by default all. Included by the top Makefile.

FEATURES_ALL := $(shell sed -n 's/^    X([A-Z]*, \([a-z]*\)).*/\1/p' firmware/settings/features.h)
FEATURES     ?= $(FEATURES_ALL)
FEATURES_OUT := $(filter-out $(FEATURES),$(FEATURES_ALL))

ifneq ($(filter-out $(FEATURES_ALL),$(FEATURES)),)
$(error mssfoc: FEATURES: no '$(firstword $(filter-out $(FEATURES_ALL),$(FEATURES)))'; there are $(FEATURES_ALL))
endif
ifeq ($(filter encoder hall sensorless,$(FEATURES)),)
$(error mssfoc: FEATURES='$(FEATURES)' has no source of the angle: add encoder, hall or sensorless)
endif
ifeq ($(filter console modbus can,$(FEATURES)),)
$(error mssfoc: FEATURES='$(FEATURES)' has nothing to operate the drive with: add console, modbus or can)
endif
ifeq ($(filter injection,$(FEATURES))$(filter sensorless,$(FEATURES)),injection)
$(error mssfoc: FEATURES='$(FEATURES)': injection needs sensorless)
endif

FEATURES_NONE   :=
FEATURES_BITS   := $(subst $(FEATURES_NONE) $(FEATURES_NONE),+,$(FEATURES_OUT:%=FEATURE_LEFT_OUT_%))
FEATURES_CHOICE := $(FEATURES_BITS:%=-DFEATURES_LEFT_OUT=%)
