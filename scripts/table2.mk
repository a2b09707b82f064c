# table2.mk - Table 2 of Ghorbani et al. 2020 for anybody's data: six models, IS and FID with intervals, the real-data row and the floor.
#
#   make table2 DATA=folder LABELS=labels.tsv OUT=table2                        (through the Makefile, or make -f scripts/table2.mk BIN=build/release/bin ...)
#
# What is finished is kept, and a training that was stopped continues: run the same line again. Other settings for the same OUT are refused:
# they would mix in one table. One model after the other uses all cores.
#   DATA LABELS      motion files and their labels (canonicalize --labels), or an archive as DATA
#   DENOISER         a denoiser (train-denoiser) that mends all clips first; OUT/mended.tsv says what it changed (none)
#   OUT=table2       folder for everything; the table is OUT/table.md, .tsv, .tex
#   ATTRIBUTES       attributes to generate by and to judge by, the action first (action gender)
#   PERIODIC OTHER   values of the first attribute: generated with 140 frames, the first 20 dropped; generated until they stand still, or OTHER_FRAMES (240)
#   STOP             sample's options for OTHER (--stop-when-still); a motion that holds a pose needs --still-seconds above the longest hold
#   SPLIT            motion-split's options (--by subject --ratios 150,25,25)
#   SELECT           motion-select's options for what the models see; classifiers see all (none)
#   PRESET STEPS     small; 8000: equal for every model
#   STEPS_erd ...    steps of one model, where models should have equal time instead
#   SAMPLES          of each model in all (8000: the paper's 1,000 for each of 8 combinations)
#   SEEDS JUDGES     seeds of the models (1) and of the classifiers that judge them (11 12)
#   MODELS           motion-cell single-layer uniform-joints no-classifier quaternet erd; any other name is a variant of motion-cell, for the studies beside the table:
#                    MODELS="motion-cell matrices" OPTIONS_matrices="--representation rotation-matrix"
#   OPTIONS OPTIONS_erd ...   more options of train-vrnn for all, or for one model
#   TRAIN_half ...   an archive that one model is trained on instead of OUT/train.h5
#   JUDGING          more options of fid-eval; FID on 32 axes where test clips are few: --pca 32
# Classifiers of the loss are trained on half A of the training sources, judges on half B with other seeds: no judge has taken part in a training.
# Real clips lose their first 20 frames where generated ones do. Each combination is generated equally often; for the figures, samples are left out at random until combinations are
# as frequent as among the real clips (fid-eval --match-classes). Models are trained on windows from anywhere, so longer real clips are cut at random places (--cut-anywhere).
SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DELETE_ON_ERROR:

OUT ?= table2
ATTRIBUTES ?= action gender
PERIODIC ?= walking jogging
OTHER ?= jumping lifting
OTHER_FRAMES ?= 240
STOP ?= --stop-when-still
SPLIT ?= --by subject --ratios 150,25,25
PRESET ?= small
STEPS ?= 8000
SAMPLES ?= 8000
SEEDS ?= 1
JUDGES ?= 11 12
MODELS ?= motion-cell single-layer uniform-joints no-classifier quaternet erd
BIN ?= build/release/bin
export PATH := $(abspath $(BIN)):$(PATH)

here := $(dir $(lastword $(MAKEFILE_LIST)))
action := $(firstword $(ATTRIBUTES))
losses := $(foreach a,$(ATTRIBUTES),$(OUT)/loss-$(a).h5)
runs := $(foreach m,$(MODELS),$(foreach s,$(SEEDS),$(m)-$(s)))
# Clips of the periodic actions without their first 20 frames at 30 Hz, the others as they are: $(call without_start,IN,OUT)
periodic_only := $(foreach v,$(PERIODIC),--attr $(action)=$(v))
define without_start
motion-select -q $(1) $(periodic_only) --time 0.6666: -f -o $(2).periodic
if [ -n "$(strip $(OTHER))" ]; then
  motion-select -q $(1) $(foreach v,$(OTHER),--attr $(action)=$(v)) -f -o $(2).other
  motion-merge -q $(2).periodic $(2).other -f -o $(2)
else
  mv $(2).periodic $(2)
fi
rm -f $(2).periodic $(2).other
endef

.PHONY: table
table: $(OUT)/table.md
	@cat $<

ifeq ($(strip $(DATA)),)
$(error usage: make table2 DATA=folder LABELS=labels.tsv OUT=table2 (scripts/table2.mk lists the rest))
endif

# MODELS, SEEDS and JUDGES may grow; what decides a file may not change under it.
# What concerns one model lies in a stamp of its own.
settings := DATA=$(DATA) LABELS=$(LABELS) DENOISER=$(DENOISER) ATTRIBUTES=$(ATTRIBUTES) PERIODIC=$(PERIODIC) OTHER=$(OTHER) OTHER_FRAMES=$(OTHER_FRAMES) STOP=$(STOP) SPLIT=$(SPLIT) SELECT=$(SELECT) PRESET=$(PRESET) STEPS=$(STEPS) SAMPLES=$(SAMPLES) JUDGING=$(JUDGING) OPTIONS=$(OPTIONS)
include $(here)stamp.mk
$(eval $(call stamp,$(OUT)/settings,$(settings),table,$(OUT)/*.h5))
$(foreach m,$(MODELS),$(eval $(call stamp,$(OUT)/settings-$(m),OPTIONS=$(OPTIONS_$(m)) STEPS=$(STEPS_$(m)) TRAIN=$(TRAIN_$(m)),model,$(OUT)/$(m)-[0-9]*.h5*)))
ifeq ($(strip $(PERIODIC)),)
  $(error PERIODIC is empty, expected at least one value of $(action))
endif

.ONESHELL:
.SECONDARY: $(foreach r,$(runs),$(OUT)/samples-$(r).h5)

$(OUT)/all.h5:
	mkdir -p $(OUT)
	if [ -d "$(DATA)" ]; then
	  # Status 1: some files were refused and are listed; the rest is done.
	  canonicalize "$(DATA)" $(if $(LABELS),--labels "$(LABELS)") --rejects $(OUT)/rejects.tsv -f -o $@.measured || [ $$? -eq 1 ]
	else
	  cp "$(DATA)" $@.measured
	fi
	$(if $(DENOISER),denoise $@.measured -m "$(DENOISER)" --report $(OUT)/mended.tsv -f -o $@,mv $@.measured $@)

$(OUT)/split/train.h5: $(OUT)/all.h5
	motion-split -f $< $(SPLIT) -o $(OUT)/split

$(OUT)/train.h5 $(OUT)/val.h5 $(OUT)/test.h5: $(OUT)/%.h5: $(OUT)/split/train.h5
	motion-select -f $(OUT)/split/$*.h5 $(foreach v,$(PERIODIC) $(OTHER),--attr $(action)=$(v)) $(SELECT) -o $@

$(OUT)/real.h5: $(OUT)/test.h5
	$(call without_start,$<,$@)
$(OUT)/known.h5: $(OUT)/train.h5
	$(call without_start,$<,$@)

$(OUT)/loss-%.h5: $(OUT)/split/train.h5
	train-classifier -f $< --attribute $* --half A --seed 1 -o $@

define judge
$(OUT)/judge-$(1)-%.h5: $(OUT)/split/train.h5
	train-classifier -f $$< --attribute $(1) --half B --seed $(2) -o $$@
endef
$(foreach a,$(ATTRIBUTES),$(foreach j,$(JUDGES),$(eval $(subst %,$(j),$(call judge,$(a),$(j))))))

# $(call kind,MODEL): the options that make it.
kind_motion-cell := $(foreach a,$(losses),--classifier $(a))
kind_single-layer := --ablate single-layer $(kind_motion-cell)
kind_uniform-joints := --ablate uniform-joints $(kind_motion-cell)
kind_no-classifier :=
kind_quaternet := --arch quaternet
kind_erd := --arch erd
kind = $(if $(filter undefined,$(origin kind_$(1))),$(kind_motion-cell),$(kind_$(1)))

define model
$(OUT)/$(1)-$(2).h5: $(or $(TRAIN_$(1)),$(OUT)/train.h5) $(OUT)/val.h5 $(if $(findstring classifier,$(call kind,$(1))),$(losses))
	train-vrnn $$< --val $(OUT)/val.h5 $(foreach a,$(ATTRIBUTES),--attribute $(a)) --preset $(PRESET) --steps $(or $(STEPS_$(1)),$(STEPS)) $(call kind,$(1)) $(OPTIONS) $(OPTIONS_$(1)) --seed $(2) --resume -o $$@
endef
$(foreach m,$(MODELS),$(foreach s,$(SEEDS),$(eval $(call model,$(m),$(s)))))

$(OUT)/samples-%.h5: $(OUT)/%.h5
	n=$$(( $(SAMPLES) * $(words $(PERIODIC)) / $(words $(PERIODIC) $(OTHER)) ))
	sample -q -m $< -n $$n $(periodic_only) --frames 140 -o - | motion-select -q - --time 0.6666: -f -o $@.periodic
	if [ -n "$(strip $(OTHER))" ]; then
	  sample -q -m $< -n $$(( $(SAMPLES) - n )) $(foreach v,$(OTHER),--attr $(action)=$(v)) --frames $(OTHER_FRAMES) $(STOP) -f -o $@.other
	  motion-merge -q $@.periodic $@.other -f -o $@
	else
	  mv $@.periodic $@
	fi
	rm -f $@.periodic $@.other

define evaluation
$(OUT)/figures-%-$(1).json: $(OUT)/samples-%.h5 $(OUT)/real.h5 $(OUT)/known.h5 $(foreach a,$(ATTRIBUTES),$(OUT)/judge-$(a)-$(1).h5)
	fid-eval -q $$< --real $(OUT)/real.h5 --train $(OUT)/known.h5 $(foreach a,$(ATTRIBUTES),--classifier $(OUT)/judge-$(a)-$(1).h5) --match-classes --cut-anywhere --mean-pose --by $(action) $(JUDGING) --json > $$@
endef
$(foreach j,$(JUDGES),$(eval $(call evaluation,$(j))))

$(OUT)/table.md: $(foreach r,$(runs),$(foreach j,$(JUDGES),$(OUT)/figures-$(r)-$(j).json)) $(here)table2-table.py
	$(here)table2-table.py $(OUT) --models $(MODELS) --seeds $(SEEDS) --judges $(JUDGES)
