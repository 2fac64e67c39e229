"""Reading and atomic writing of files: recordings as NetCDF and CSV, and result folders."""

from ppafo.storage.comma_separated import read_csv, write_csv
from ppafo.storage.netcdf import dataset_of
from ppafo.storage.result_folder import StoredResult, check_result_folder, read_stored, write_result

__all__ = [
    "StoredResult",
    "check_result_folder",
    "dataset_of",
    "read_csv",
    "read_stored",
    "write_csv",
    "write_result",
]
