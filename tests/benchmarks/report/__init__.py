# SPDX-License-Identifier: GPL-3.0-or-later
"""The report: error against run time, beside what an artist would pick instead."""
