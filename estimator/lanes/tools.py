"""numba's tools for new types. They carry no types themselves."""

from __future__ import annotations

from typing import Any

from numba import extending
from numba.core import cgutils as core_cgutils
from numba.core import datamodel, typeconv, typing
from numba.core import types as core_types

types: Any = core_types
cgutils: Any = core_cgutils
PrimitiveModel: Any = datamodel.models.PrimitiveModel
Conversion: Any = vars(typeconv)["Conversion"]
signature: Any = vars(typing)["signature"]
defined_once: Any = core_cgutils.get_or_insert_function
intrinsic: Any = extending.intrinsic
overload: Any = extending.overload
type_callable: Any = extending.type_callable
lower_builtin: Any = extending.lower_builtin
lower_cast: Any = extending.lower_cast
register_jitable: Any = extending.register_jitable
register_model: Any = extending.register_model
