"""Writers of materials and tables in other tools' formats, one file each; see contract.py."""
