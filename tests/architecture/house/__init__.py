"""The source tree as data: files, imports, circles, comments and names, read without building anything.

Plain Python and the standard library, so that `report.py` runs before anything is installed.
"""
