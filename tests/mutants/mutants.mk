# SPDX-License-Identifier: MIT
# Faults put into the drive, and who notices: docs/mutants.md. Included by the top Makefile, which defines PYTHON.

mutants: LASTS = hours for the 220 of a whole run, minutes for N=10
mutants: tools-test
	$(says)
	@$(PYTHON) tests/mutants/run.py $(if $(N),--count $(N)) $(if $(filter-out file default,$(origin SEED)),--seed $(SEED)) \
	    $(if $(FILES),--files '$(FILES)') $(if $(JOBS),--jobs $(JOBS)) \
	    $(if $(RUNGS),--rungs '$(RUNGS)') $(if $(KEEP_GOING),--keep-going) $(if $(LISTED),--listed) \
	    $(if $(BUDGET),--budget $(BUDGET)) $(if $(REMEMBER),--remember)

.PHONY: mutants
