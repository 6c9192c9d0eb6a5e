import math
import struct

import pytest
from pymavlink.dialects.v20 import development as dialect

from tests.sim_mavlink.bench import Bench, Message, only

NAMES = ["COM_OBL_RC_ACT", "COM_OF_LOSS_T", "MAV_SYS_ID", "MIS_TAKEOFF_ALT", "NAV_DLL_ACT"]
INT32, REAL32 = 6, 9


def _read(bench: Bench, name: str = "", index: int = -1, target: tuple[int, int] = (1, 1)) -> list[Message]:
    return bench.ask(dialect.MAVLink_param_request_read_message(*target, name.encode(), index))


def _set(bench: Bench, name: str, value: float, kind: int) -> Message:
    (answer,) = bench.ask(dialect.MAVLink_param_set_message(1, 1, name.encode(), value, kind))
    return answer


def _as_int(value: float) -> int:
    return int(struct.unpack("<i", struct.pack("<f", value))[0])


def _as_float(value: int) -> float:
    return float(struct.unpack("<f", struct.pack("<i", value))[0])


@pytest.fixture
def bench() -> Bench:
    """An endpoint with five parameters."""
    return Bench()


def test_floats_are_read_by_name(bench: Bench) -> None:
    """Value, type, place and number of the parameters."""
    (m,) = _read(bench, "COM_OF_LOSS_T")
    assert (m.param_id, m.param_value, m.param_type) == ("COM_OF_LOSS_T", 1.0, REAL32)
    assert (m.param_index, m.param_count) == (1, 5)


def test_integers_travel_as_bits(bench: Bench) -> None:
    """The recording has 7e-45 for COM_OBL_RC_ACT = 5; negative numbers come through as well."""
    (m,) = _read(bench, "COM_OBL_RC_ACT")
    assert (m.param_value, m.param_type) == (7.006492321624085e-45, INT32)
    (m,) = _read(bench, "NAV_DLL_ACT")
    assert _as_int(m.param_value) == -3


def test_parameters_are_read_by_index(bench: Bench) -> None:
    """The index is the place in the order of names."""
    assert [_read(bench, index=i)[0].param_id for i in range(5)] == NAMES


def test_what_does_not_exist_is_told_by_an_error(bench: Bench) -> None:
    """PARAM_ERROR 1 for an unknown name (as recorded) or index, addressed to who asked."""
    (m,) = _read(bench, "NO_SUCH_PARAM")
    assert (m.get_type(), m.param_id, m.error) == ("PARAM_ERROR", "NO_SUCH_PARAM", 1)
    assert (m.target_system, m.target_component) == (1, 191)
    (m,) = _read(bench, index=5)
    assert (m.error, m.param_index) == (1, 5)
    assert _set(bench, "NO_SUCH_PARAM", 1.0, REAL32).error == 1


def test_a_list_comes_complete_and_in_order(bench: Bench) -> None:
    """PARAM_REQUEST_LIST is answered over the next turns by every parameter once."""
    assert bench.ask(dialect.MAVLink_param_request_list_message(1, 1)) == []
    received = only(bench.run(0.1), "PARAM_VALUE")
    assert [(m.param_id, m.param_index) for m in received] == [(name, i) for i, name in enumerate(NAMES)]


def test_a_long_list_does_not_hold_up_telemetry(bench: Bench) -> None:
    """At most 20 parameters go out in a turn."""
    bench.vehicle.parameters.update({f"P{i}": (float, 1.0) for i in range(100)})
    bench.ask(dialect.MAVLink_param_request_list_message(1, 0))
    first = only(bench.run(bench.vehicle.step_s), "PARAM_VALUE")
    assert len(first) == 20
    assert len(only(bench.run(0.1), "PARAM_VALUE")) == 85


def test_a_set_is_answered_by_the_new_value(bench: Bench) -> None:
    """Floats and integers, each in its own encoding."""
    assert _set(bench, "MIS_TAKEOFF_ALT", 3.0, REAL32).param_value == 3.0
    assert bench.vehicle.parameters["MIS_TAKEOFF_ALT"] == (float, 3.0)
    assert _as_int(_set(bench, "COM_OBL_RC_ACT", _as_float(4), INT32).param_value) == 4
    assert bench.vehicle.parameters["COM_OBL_RC_ACT"] == (int, 4)


@pytest.mark.parametrize(
    ("name", "value", "kind", "error"),
    [
        ("MIS_TAKEOFF_ALT", 3.0, INT32, 7),
        ("COM_OBL_RC_ACT", 3.0, REAL32, 7),
        ("COM_OBL_RC_ACT", 3.0, 4, 6),
        ("MIS_TAKEOFF_ALT", math.nan, REAL32, 2),
        ("MIS_TAKEOFF_ALT", math.inf, REAL32, 2),
    ],
)
def test_a_wrong_set_is_told_and_changes_nothing(bench: Bench, name: str, value: float, kind: int, error: int) -> None:
    """Wrong type, unknown type, no finite value."""
    before = dict(bench.vehicle.parameters)
    assert _set(bench, name, value, kind).error == error
    assert bench.vehicle.parameters == before


@pytest.mark.parametrize("target", [(2, 1), (1, 2), (0, 1)])
def test_requests_to_others_are_left_alone(bench: Bench, target: tuple[int, int]) -> None:
    """PX4 wants its own system id in parameter requests."""
    assert _read(bench, "COM_OF_LOSS_T", target=target) == []


def test_names_of_any_bytes_are_survived(bench: Bench) -> None:
    """A name that is no text does not exist."""
    message = dialect.MAVLink_param_request_read_message(1, 1, bytes(range(200, 216)), -1)
    (m,) = bench.ask(message)
    assert m.error == 1


def test_the_system_id_is_a_parameter(bench: Bench) -> None:
    """MAV_SYS_ID is the id that the server was started with."""
    other = Bench(system_id=7)
    assert _as_int(_read(other, "MAV_SYS_ID", target=(7, 1))[0].param_value) == 7
