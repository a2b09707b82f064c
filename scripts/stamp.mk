# stamp.mk - What a folder of results was begun with: the settings that decide its files may not change under them.
# $(eval $(call stamp,FILE,SETTINGS,WHAT,FILES)); where none of FILES is there yet, settings may still change.
define stamp
ifneq ($$(and $$(wildcard $(1)),$$(wildcard $(4))),)
  ifneq ($$(strip $(2)),$$(strip $$(file < $(1))))
    $$(error $(1): this $(3) was begun with other settings, expected the same or another OUT)
  endif
else ifeq ($$(findstring n,$$(firstword -$$(MAKEFLAGS))),)
  $$(shell mkdir -p $(OUT))
  $$(file > $(1),$(2))
endif
endef
