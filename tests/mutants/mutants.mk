# SPDX-License-Identifier: MIT
# Mistakes put into the drive and its plant, and who notices: docs/mutants.md. Included by the top Makefile.

MUTANTS_NEED = $(addprefix $(BUILD)/,$(addprefix packed/1/,data_sheet_text.h message_texts.h) fabric/contract3.h \
    bringup/documented.h)

mutants: LASTS = some two hours for all 400, minutes for N=10; goes on where it was ended
mutants: tools-test $(MUTANTS_NEED)
	$(says)
	@$(PYTHON) tests/mutants/run.py $(if $(N),--count $(N)) $(if $(filter-out file default,$(origin SEED)),--seed $(SEED)) \
	    $(if $(FILES),--files '$(FILES)') $(if $(BY),--by '$(BY)') $(if $(JOBS),--jobs $(JOBS)) \
	    $(if $(RUNGS),--rungs '$(RUNGS)') \
	    $(if $(BUDGET),--budget $(BUDGET)) $(if $(REMEMBER),--remember) $(if $(PART),--part $(PART))

.PHONY: mutants
