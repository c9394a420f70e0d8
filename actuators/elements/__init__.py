"""Elements of an actuator: one law between two neighbouring shafts each.

A new one is a file here, in which its class says what catalogues call it.
"""

from importlib import import_module
from pkgutil import iter_modules

for _module in iter_modules(__path__):
    import_module(f"{__name__}.{_module.name}")
