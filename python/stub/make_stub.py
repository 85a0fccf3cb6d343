"""Writes ear/__init__.pyi, the types of the module: make_stub.py. Run it after a change of the interface.

What C++ knows of types stands in TYPES below, once per name; names, arguments and docstrings come from the module. A test
compares the file with what this would write, so that neither can be forgotten.
"""

import inspect
import re
import sys
from pathlib import Path

import ear

STUB = Path(__file__).resolve().parent.parent / "ear/__init__.pyi"

HEADING = '''"""The types of the module; written by python/stub/make_stub.py."""

import os
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Literal, TypedDict, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

Path = str | os.PathLike[str]
Sample = ImuSample | EncoderSample | LaserSample | StereoFrame

class Truth(TypedDict):
    t_ns: NDArray[np.int64]
    p_WB: NDArray[np.float64]
    q_WB: NDArray[np.float64]
    v_W: NDArray[np.float64]

__version__: str
'''

ARRAY, IMAGE = "NDArray[np.float64]", "NDArray[np.uint8]"

# By `Class.name`, else by `name`; a field that is not here has the type of its value in a fresh object.
FIELDS = {
    "gyro_B": ARRAY, "accel_B": ARRAY, "LaserSample.range": "tuple[float, ...]", "StereoFrame.left": IMAGE,
    "StereoFrame.right": f"{IMAGE} | None", "FeatureFrame.left": ARRAY, "FeatureFrame.right": ARRAY,
    "FeatureFrame.ids": "NDArray[np.uint64]", "FeatureFrame.right_skipped": "bool", "FeatureFrame.repeated": "bool",
    "FeatureFrame.t_ns": "int", "StereoFrame.t_ns": "int",
    "pose_sigma": "PoseSigma | None", "intrinsics_sigma": "IntrinsicsSigma | None",
    "gyro_bias_sigma": "float | None", "accel_bias_sigma": "float | None", "gyro_scale_sigma": "float | None", "accel_scale_sigma": "float | None",
    "T_BO_sigma": "PoseSigma | None", "wheel_radius_sigma": "float | None", "wheel_radius_difference_sigma": "float | None",
    "track_width_sigma": "float | None", "offset_sigma": "float | None", "camera_time_offset_sigma": "float | None",
    "time_offset_sigma": "float | None",
    "encoder": "EncoderCalibration | None", "InputCounts.encoder": "StreamCounts", "lasers": "LaserCalibration | None",
    "cameras": "tuple[CameraCalibration, ...]", "beams": "tuple[LaserBeam, ...]", "T_BC": ARRAY, "T_BO": ARRAY,
    "gyro_matrix": ARRAY, "p_BL": ARRAY, "d_B": ARRAY, "q_WB": ARRAY, "p_WB": ARRAY, "v_W": ARRAY, "b_g": ARRAY, "b_a": ARRAY, "covariance": ARRAY,
    "distortion": "tuple[float, float, float, float, float]", "wheel_radius": "tuple[float, float]",
    "PriorConfig.wheel_radius": "float",
    "available": "tuple[bool, bool, bool]", "coefficient": "tuple[float, float, float]",
    "weight": "tuple[float, float, float]", "AnomalyConfig.weight": "str",
    "anomalous": 'Literal["imu", "odometer", "camera"] | None', "disagree": "bool", "rejected": "int",
    "SourceRecord.rejected": "int", "SourceRecord.score": "float",
    "faulty": "tuple[str, ...]", "onset_ns": "dict[str, int]", "sources": "dict[str, SourceRecord]",
    "Health.status": "HealthStatus", "Health.reason": "Reason", "Health.since_ns": "int", "Health.imprecise": "bool",
    "Health.misaligned": "bool",
    "Health.aiding": "Aiding", "Health.quality": "int", "Health.horizontal_sigma": "float",
    "Health.vertical_sigma": "float", "Health.reset_counter": "int", "Health.load_step": "int", "Health.reason_text": "str",
    "Recording.calibration": "Calibration", "Recording.span": "tuple[int, int]", "Recording.warnings": "tuple[Warning, ...]",
    "status": "Status", "health": "Health", "input_counts": "InputCounts", "stage_times": "StageTimes",
    "Odometry.calibration": "Calibration", "Simulation.calibration": "Calibration",
    "Simulation.true_calibration": "Calibration", "Simulation.path_length": "float", "Simulation.truth": "Truth",
}

# Signatures without the name; several are overloads.
FUNCTIONS = {
    "Recording.__init__": ["self, path: Path, calibration_files: Sequence[Path] = (), camera_rate_hz: float = 0.0,"
                           " mono: bool = False, config: Path | None = None) -> None"],
    "Recording.__iter__": ["self) -> Iterator[Sample]"],
    "Recording.__next__": ["self) -> Sample"],
    "Odometry.__init__": ["self, calibration: Calibration, config: Config = ...) -> None"],
    "Filter.__init__": ["self, calibration: Calibration, config: FilterConfig = ...) -> None"],
    "Simulation.__init__": ["self, sequence: str = 'flat1', seed: int = 1, duration: float | None = None,"
                            " camera_rate_hz: float = 30.0, calibration_error: float | None = None,"
                            " faults: Sequence[str] = (), tracks: bool = True) -> None"],
    "Simulation.__iter__": ["self) -> SimulatedSamples"],
    "Simulation.write": ["self, folder: Path, images: bool = True, threads: int = ...) -> None"],
    "SimulatedSamples.__iter__": ["self) -> SimulatedSamples"],
    "SimulatedSamples.__next__": ["self) -> ImuSample | EncoderSample | LaserSample | FeatureFrame"],
    "FeatureFrame.__init__": ["self, t_ns: int, ids: ArrayLike, left: ArrayLike, right: ArrayLike | None = None,"
                              " right_skipped: bool = False, repeated: bool = False) -> None"],
    "FeatureFrame.__len__": ["self) -> int"],
    "add_imu": ["self, sample: ImuSample) -> None",
                "self, t_ns: int | NDArray[np.int64], gyro_B: ArrayLike, accel_B: ArrayLike) -> None"],
    "add_encoder": ["self, sample: EncoderSample) -> None", "self, t_ns: int, left_count: int, right_count: int) -> None"],
    "add_laser": ["self, sample: LaserSample) -> None", "self, t_ns: int, range: Sequence[float]) -> None"],
    "add_stereo": ["self, frame: StereoFrame) -> Estimate | None",
                   f"self, t_ns: int, left: {IMAGE}, right: {IMAGE} | None = None) -> Estimate | None"],
    "frame_time": ["self, t_ns: int) -> int"],
    "start_at": ["self, start: GivenStart) -> None"],
    "predict": ["self, t_ns: int) -> NavState | None"],
    "step": ["self, t_ns: int) -> Estimate | None"],
    "reset": ["self) -> None"],
    "process": ["self, frame: FeatureFrame) -> Estimate | None"],
    "process_without_image": ["self, t_ns: int) -> Estimate | None"],
    "common_stamp": ["self, t_ns: int) -> int | None"],
    "motion_to": [f"self, t_ns: int) -> tuple[{ARRAY}, {ARRAY} | None] | None"],
    "load_config": ["file: Path) -> Config"],
    "save_config": ["config: Config, file: Path) -> None"],
    "load_calibration": ["folder: Path, calibration_files: Sequence[Path] = ()) -> Calibration"],
    "sequences": [") -> list[str]"],
    "replay": ["recording: Recording, odometry: Odometry, on_frame: Callable[[int, Estimate | None], None] | None = None)"
               " -> list[Estimate]", "simulation: Simulation, filter: Filter) -> list[Estimate]"],
    "evaluate": ["estimate: Path | Sequence[Estimate], truth: Path | Simulation, align: str = 'yaw',"
                 " truth_error: float = 0.1) -> dict[str, Any]"],
    "write_states": ["file: Path, estimates: Sequence[Estimate]) -> None"],
    "write_tum": ["file: Path, estimates: Sequence[Estimate]) -> None"],
}

EVERYWHERE = {"__doc__", "__module__", "__repr__", "__str__", "__copy__", "__deepcopy__", "__pybind11_module_local_v4_gcc_libstdcpp_cxxabi1014__"}


def lookup(table, owner, name):
    return table.get(f"{owner}.{name}", table.get(name))


def type_of_field(cls, name):
    known = lookup(FIELDS, cls.__name__, name)
    return known or type(getattr(cls(), name)).__name__


def function_lines(owner, name, indent):
    signatures = lookup(FUNCTIONS, owner, name)
    if signatures is None:
        raise KeyError(f"make_stub.py does not know the types of {owner}.{name}")
    overload = f"{indent}@overload\n" if len(signatures) > 1 else ""
    return "".join(f"{overload}{indent}def {name}({signature}: ...\n" for signature in signatures)


def enumeration_lines(cls):
    members = "".join(f"    {name}: {cls.__name__}\n" for name in cls.__members__)
    return members + "    @property\n    def name(self) -> str: ...\n    @property\n    def value(self) -> int: ...\n"


def value_lines(cls, fields):
    """A plain struct: its fields by keyword, and a changed copy."""
    def arguments():
        return ", ".join(f"{name}: {accepted(type_of_field(cls, name))} = ..." for name in fields)
    return (f"    def __init__(self, {arguments()}) -> None: ...\n"
            f"    def replace(self, *, {arguments()}) -> {cls.__name__}: ...\n")


def accepted(field_type):
    """What a field of this type takes: whatever NumPy makes into the array, any sequence."""
    if field_type.startswith("NDArray"):
        return "ArrayLike"
    items = re.fullmatch(r"tuple\[(\w+), .*\]", field_type)
    return f"Sequence[{items[1]}]" if items else field_type


def class_lines(cls):
    if hasattr(cls, "__members__"):
        return enumeration_lines(cls)
    members = vars(cls)
    fields = list(members.get("_fields", ()))
    lines = ""
    for name in [*fields, *(n for n, m in members.items() if isinstance(m, property) and n not in fields)]:
        lines += f"    @property\n    def {name}(self) -> {type_of_field(cls, name)}: ...\n"
        if members[name].fset:
            lines += f"    @{name}.setter\n    def {name}(self, given: {type_of_field(cls, name)}) -> None: ...\n"
    if "replace" in members:
        lines += value_lines(cls, fields)
    elif "copy" in members:
        lines += f"    def __init__(self) -> None: ...\n    def copy(self) -> {cls.__name__}: ...\n"
    for name, member in members.items():
        if name in EVERYWHERE or name.startswith("__pybind11") or isinstance(member, property) or name == "_fields":
            continue
        if name in ("replace", "copy") or (name == "__init__" and ("replace" in members or "copy" in members)):
            continue
        if name == "__init__" and lookup(FUNCTIONS, cls.__name__, name) is None:
            continue  # made by the module alone
        lines += function_lines(cls.__name__, name, "    ")
    return lines


def names():
    return [name for name in vars(ear._ear) if not name.startswith("_")]


def stub():
    text = HEADING
    for name in names():
        thing = getattr(ear, name)
        if inspect.isclass(thing) and issubclass(thing, Exception):
            text += f"\nclass {name}(ValueError): ...\n"
        elif inspect.isclass(thing):
            doc = inspect.cleandoc(thing.__doc__ or "").split("\n")[0]
            text += f'\nclass {name}:\n    """{doc}"""\n' + class_lines(thing)
        else:
            text += "\n" + function_lines(name, name, "")
    return text


if __name__ == "__main__":
    STUB.write_text(stub(), encoding="utf-8")
    print(STUB)
    sys.exit(0)
