"""The names of before; see `pipeline.logs.log`."""

from pipeline.logs.contact import Contact as Contact
from pipeline.logs.log import TEST as TEST
from pipeline.logs.log import TRAIN as TRAIN
from pipeline.logs.log import UNUSED as UNUSED
from pipeline.logs.log import VALIDATION as VALIDATION
from pipeline.logs.log import Log as Measurement  # noqa: F401
from pipeline.logs.rest import near_rest as near_rest
from pipeline.logs.rest import within as within
