# SPDX-License-Identifier: MIT
"""Writes Libero projects: python3 -m libero BOARD BUILD, with drivers/fabric on the path; see docs/libero.md."""
