"""What tools/package_release.py stands on: archives that are the same bytes each time, and what is linked into a program."""
