# refinement.mk - What the refiner does to generated motion: the counterpart of Fig. 12 of Wang, Chai, Xia 2018 without people, for anybody's data.
#
#   make refinement DATA=folder LABELS=labels.tsv OUT=refinement                (through the Makefile, or make -f scripts/refinement.mk BIN=build/release/bin ...)
#
# Rows: captured motion, the generator, refined blind to contacts, refined with contacts; each as it is and with its feet pinned.
# What is finished is kept, and a training that was stopped continues: run the same line again. Other settings for the same OUT are refused.
#   DATA LABELS      motion files and their labels (canonicalize --labels), or an archive as DATA
#   OUT=refinement   folder for everything; the table is OUT/table.md and .tsv
#   ATTRIBUTE VALUES what the models see: clips with one of these values of an attribute (action; walking running)
#   SELECT           more of motion-select's options for what the models and the test see, such as --attr "description!=walk on uneven terrain" (none)
#   CANONICALIZE     its options (--mirror --phases all); where DATA is an archive, none
#   SPLIT            motion-split's options (--ratios 70,10,20, by source)
#   REAL             which test clips to compare with: motion-select's options (--mirrored no --phase 0)
#   GENERATOR        a model that `sample` knows, instead of an LSTM trained here
#   PRESET STEPS     of the LSTM (small; 3000)
#   GENERAL_STEPS    steps on all training clips before those on VALUES (0)
#   LSTM             more options of train-lstm
#   REFINER_STEPS    updates of either network (6000)
#   REFINER          more options of train-refiner; --window 30 where clips are short: those shorter than a window are never seen
#   SAMPLES FRAMES   motions judged, frames of each (400, 150)
#   NOISE            factor on the generator's noise, of what the refiners see and of what is judged (1)
#   PIN              options of refine --pin-feet
#   JUDGE            classifier of ATTRIBUTE that gives the features of FID and KID (trained here on all training clips)
#   LABELLER         another that labels generated motion, so that mixes of values are matched and each value has rows of its own (trained here on the clips of VALUES)
#   JUDGING          more options of fid-eval; FID on few axes where test clips are few (--pca 32)
#   SEED=1           of all of it
SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DELETE_ON_ERROR:
.SECONDARY:
.ONESHELL:

OUT ?= refinement
ATTRIBUTE ?= action
VALUES ?= walking running
CANONICALIZE ?= --mirror --phases all
SPLIT ?= --ratios 70,10,20
REAL ?= --mirrored no --phase 0
PRESET ?= small
STEPS ?= 3000
GENERAL_STEPS ?= 0
REFINER_STEPS ?= 6000
SAMPLES ?= 400
FRAMES ?= 150
NOISE ?= 1
JUDGING ?= --pca 32
SEED ?= 1
BIN ?= build/release/bin
export PATH := $(abspath $(BIN)):$(PATH)

here := $(dir $(lastword $(MAKEFILE_LIST)))
generator := $(or $(GENERATOR),$(OUT)/lstm.h5)
judge := $(or $(JUDGE),$(OUT)/judge.h5)
labeller := $(or $(LABELLER),$(OUT)/labeller.h5)
chosen := $(foreach v,$(VALUES),--attr $(ATTRIBUTE)=$(v)) $(SELECT)
rows := mocap generated plain contacts
all_rows := $(foreach r,$(rows),$(r) $(r)-pinned)

.PHONY: table
table: $(OUT)/table.md
	@cat $<

ifeq ($(strip $(DATA)),)
$(error usage: make refinement DATA=folder LABELS=labels.tsv OUT=refinement (scripts/refinement.mk lists the rest))
endif

settings := DATA=$(DATA) LABELS=$(LABELS) ATTRIBUTE=$(ATTRIBUTE) VALUES=$(VALUES) SELECT=$(SELECT) CANONICALIZE=$(CANONICALIZE) SPLIT=$(SPLIT) REAL=$(REAL) GENERATOR=$(GENERATOR) PRESET=$(PRESET) STEPS=$(STEPS) \
  GENERAL_STEPS=$(GENERAL_STEPS) LSTM=$(LSTM) REFINER_STEPS=$(REFINER_STEPS) REFINER=$(REFINER) SAMPLES=$(SAMPLES) FRAMES=$(FRAMES) NOISE=$(NOISE) PIN=$(PIN) JUDGE=$(JUDGE) LABELLER=$(LABELLER) JUDGING=$(JUDGING) SEED=$(SEED)
include $(here)stamp.mk
$(eval $(call stamp,$(OUT)/settings,$(settings),table,$(OUT)/*.h5))

$(OUT)/all.h5:
	if [ -d "$(DATA)" ]; then
	  # Status 1: some files were refused and are listed; the rest is done.
	  canonicalize "$(DATA)" $(if $(LABELS),--labels "$(LABELS)") $(CANONICALIZE) --rejects $(OUT)/rejects.tsv -f -o $@ || [ $$? -eq 1 ]
	else
	  cp "$(DATA)" $@
	fi

$(OUT)/split/train.h5: $(OUT)/all.h5
	motion-split -f $< $(SPLIT) --seed $(SEED) -o $(OUT)/split

$(OUT)/train.h5 $(OUT)/val.h5: $(OUT)/%.h5: $(OUT)/split/train.h5
	motion-select -f $(OUT)/split/$*.h5 $(chosen) -o $@

$(OUT)/real.h5: $(OUT)/split/train.h5
	motion-select -f $(OUT)/split/test.h5 $(chosen) $(REAL) -o $@

$(OUT)/mocap.h5: $(OUT)/train.h5
	motion-select -f $< $(REAL) -o $@

$(OUT)/labeller.h5: $(OUT)/train.h5
	train-classifier -f $< --attribute $(ATTRIBUTE) --seed 1 -o $@

$(OUT)/judge.h5: $(OUT)/split/train.h5
	train-classifier -f $< --attribute $(ATTRIBUTE) --seed 11 -o $@

lstm_options := --preset $(PRESET) --seed $(SEED) $(LSTM) --resume
$(OUT)/general.h5: $(OUT)/split/train.h5 $(OUT)/val.h5
	train-lstm $< --val $(OUT)/val.h5 --steps $(GENERAL_STEPS) $(lstm_options) -o $@ > $(OUT)/general.txt

$(OUT)/lstm.h5: $(OUT)/train.h5 $(OUT)/val.h5 $(if $(filter-out 0,$(GENERAL_STEPS)),$(OUT)/general.h5)
	train-lstm $< --val $(OUT)/val.h5 $(if $(filter-out 0,$(GENERAL_STEPS)),--init-from $(OUT)/general.h5) --steps $(STEPS) $(lstm_options) -o $@ > $(OUT)/lstm.txt

$(OUT)/refiner-%.h5: $(OUT)/train.h5 $(generator)
	train-refiner $< --generator $(generator) --noise-scale $(NOISE) $(if $(filter plain,$*),--no-contacts) --steps $(REFINER_STEPS) --seed $(SEED) $(REFINER) --resume -o $@

$(OUT)/generated.h5: $(generator) $(labeller)
	sample -q -m $< -n $(SAMPLES) --frames $(FRAMES) --noise-scale $(NOISE) --seed $(SEED) -o - | $(if $(GENERATOR),cat,classify - -m $(labeller) -o -) > $@

$(OUT)/plain.h5 $(OUT)/contacts.h5: $(OUT)/%.h5: $(OUT)/refiner-%.h5 $(OUT)/generated.h5
	refine -q $(OUT)/generated.h5 -m $< -f -o $@

$(OUT)/%-pinned.h5: $(OUT)/%.h5
	refine $< --pin-feet $(PIN) -f -o $@

$(OUT)/figures-%.json: $(OUT)/%.h5 $(OUT)/real.h5 $(OUT)/mocap.h5 $(judge)
	fid-eval -q $< --real $(OUT)/real.h5 --train $(OUT)/mocap.h5 --classifier $(judge) --match-classes --cut-anywhere --by $(ATTRIBUTE) $(JUDGING) --json > $@

# Speeds beside those of what was refined.
input_of = $(OUT)/$(if $(filter mocap%,$1),mocap,generated).h5
$(OUT)/compared-%.json: $(OUT)/%.h5 $(OUT)/mocap.h5 $(OUT)/generated.h5
	motion-compare -q $< --real $(call input_of,$*) --by $(ATTRIBUTE) --json > $@

$(OUT)/table.md: $(foreach r,$(all_rows),$(OUT)/figures-$(r).json $(OUT)/compared-$(r).json) $(here)refinement-table.py
	$(here)refinement-table.py $(OUT)
