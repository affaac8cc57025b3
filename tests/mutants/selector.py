# SPDX-License-Identifier: MIT
"""The same for programs in Python: executed at the head of each file with mutants in it."""


def _mutant(number):
    from os import environ
    path = environ.get("MUTANTS_MET")
    if path:
        try:
            with open(path, "r+b") as file:
                file.seek(number)
                file.write(b"\1")
        except OSError:
            pass
    return environ.get("MUTANTS_NOW") == str(number)
