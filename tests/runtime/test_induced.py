"""`robot.induced_accelerations`: shares that sum up, of joints, points and the centre of mass; messages."""

from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from conftest import DATA, needs_compiler
from helpers.answers import relative_error

torch = pytest.importorskip("torch")

Packages = Callable[[str], ModuleType]
BACKENDS = ("numpy", "torch", "autograd", pytest.param("native", marks=needs_compiler))
CRANE = f"{DATA / 'crane.urdf'} loops"


def motion_of(robot: Any, *batch: int, dtype: str = "float64") -> tuple[Any, ...]:
    arrays = np.random.default_rng(5).uniform(-1.5, 1.5, (3, *batch, robot.n)).astype(dtype)
    return tuple(torch.from_numpy(arrays)) if robot.backend.takes_tensors else tuple(arrays)


def as_array(value: Any) -> Any:
    return value.detach().numpy() if torch.is_tensor(value) else value


@pytest.mark.parametrize("backend", BACKENDS)
def test_loads_and_points_may_be_of_more_samples_than_the_state(backend: str, package_of: Packages) -> None:
    package = package_of(CRANE)
    robot = package.load(backend)
    q, qd, tau = motion_of(robot)
    frame, points = robot.kinematics.frames[-1], np.random.default_rng(1).normal(size=(4, 3))
    many = [package.AppliedLoad(robot.link_names[-1], points)]
    shares = robot.induced_accelerations(q, qd, tau, loads=many, frame=frame, point=points)
    for k, point in enumerate(points):
        load = package.AppliedLoad(robot.link_names[-1], point)
        one = robot.induced_accelerations(q, qd, tau, loads=[load], frame=frame, point=point)
        for share, expected in zip(shares, one, strict=True):
            np.testing.assert_allclose(as_array(share)[k], as_array(expected), rtol=1e-11, atol=1e-11)
    moved = robot.simulate(q, qd, [0.0, 0.01], loads=many)
    one = robot.simulate(q, qd, [0.0, 0.01], loads=[load])
    np.testing.assert_allclose(as_array(moved.q)[:, -1], as_array(one.q), rtol=1e-12)
    told = (
        r"^loads\[0\]\.force: \(4,\) samples are more than the \(\) of q and qd; give these as many from the"
    )
    with pytest.raises(ValueError, match=told):
        robot.simulate(q, qd, [0.0, 0.01], loads=lambda t, q, qd: many)


@pytest.mark.parametrize("batch", [(), (2, 3), (0,)])
@pytest.mark.parametrize("backend", BACKENDS)
def test_shares_sum_to_what_forward_dynamics_and_kinematics_say(
    backend: str, batch: tuple[int, ...], package_of: Packages
) -> None:
    package = package_of(CRANE)
    robot = package.load(backend)
    q, qd, tau = motion_of(robot, *batch)
    load = package.AppliedLoad(robot.link_names[-1], [3.0, -2.0, 9.0], [0.1, 0.2, 0.3], at=[0.4, 0.1, 1.0])
    pull = robot.kinematics.load_torque(q, *load)
    for passive in (False, True):
        shares = robot.induced_accelerations(q, qd, tau, loads=[load], passive=passive)
        qdd = robot.forward_dynamics(q, qd, tau - pull, passive)
        scale = max(1.0, float(np.abs(as_array(qdd)).max(initial=0.0)))
        assert np.abs(as_array(shares.residual(qdd))).max(initial=0.0) <= 1e-12 * scale
        where = {"frame": robot.kinematics.frames[-1], "point": [0.1, 0.2, 0.3]}
        seen = robot.induced_accelerations(q, qd, tau, loads=[load], passive=passive, **where)
        moved = robot.kinematics.acceleration(q, qd, qdd, **where)
        assert np.abs(as_array(seen.residual(moved))).max(initial=0.0) <= 1e-12 * scale
        centre = robot.induced_accelerations(
            q, qd, tau, loads=[load], passive=passive, frame="centre of mass"
        )
        jacobian, rate = (
            as_array(robot.kinematics.centre_of_mass_jacobian(q)),
            as_array(robot.kinematics.centre_of_mass_jacobian_rate(q, qd)),
        )
        expected = np.einsum("...ij,...j->...i", jacobian, as_array(qdd))
        expected = expected + np.einsum("...ij,...j->...i", rate, as_array(qd))
        assert np.abs(as_array(centre.total) - expected).max(initial=0.0) <= 1e-12 * scale
    n, links = robot.n, robot.N
    tails = ((n,), (links, n), (links,), (3, n), (1,), (n,), (n,))
    assert [tuple(share.shape) for share in shares] == [(*batch, n, *tail) for tail in tails]
    assert [tuple(share.shape) for share in seen] == [(*batch, 6, *tail) for tail in tails]


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_measured_motion_is_what_its_actuators_and_loads_give(backend: str, package_of: Packages) -> None:
    package = package_of(CRANE)
    robot = package.load(backend)
    q, qd, qdd = motion_of(robot, 4)
    pair = [package.AppliedLoad(2, [0, 0, 5.0]), package.AppliedLoad(1, [0, 0, -5.0])]
    shares = robot.induced_accelerations(q, qd, qdd=qdd, loads=[pair], passive=True)
    assert np.abs(as_array(shares.residual(qdd))).max() <= 1e-12
    pulls = sum(robot.kinematics.load_torque(q, *load) for load in pair)
    needed = robot.inverse_dynamics(q, qd, qdd) + robot.passive_torque(q, qd, qdd).total + pulls
    given = robot.induced_accelerations(q, qd, needed, loads=[pair], passive=True)
    for one, other in zip(shares, given, strict=True):
        assert relative_error(as_array(one) + 1.0, as_array(other) + 1.0) <= 1e-11


def test_links_of_energies_have_shares_too(package_of: Packages) -> None:
    robot = package_of(str(DATA / "turntable.py")).load("numpy")
    q, qd, tau = motion_of(robot, 3)
    shares = robot.induced_accelerations(q, qd, tau)
    assert relative_error(shares.total, robot.forward_dynamics(q, qd, tau)) <= 1e-12


def test_single_precision_stays_so(package_of: Packages) -> None:
    robot = package_of(CRANE).load("numpy")
    motion = motion_of(robot, 3, dtype="float32")
    shares = robot.induced_accelerations(*motion, frame=1)
    assert {share.dtype for share in shares} == {np.dtype("f4")}
    exact = robot.induced_accelerations(*(a.astype(float) for a in motion), frame=1)
    assert relative_error(shares.total, exact.total) <= 1e-4


def test_gradients_flow_to_motion_and_loads(package_of: Packages) -> None:
    package = package_of(CRANE)
    robot = package.load("torch")
    q, qd, tau = (a.requires_grad_() for a in motion_of(robot))
    force = torch.tensor([1.0, 2.0, 3.0], dtype=torch.float64, requires_grad=True)

    def share(*given: Any) -> Any:
        *motion, pull = given
        load = package.AppliedLoad(robot.link_names[-1], pull)
        found = robot.induced_accelerations(*motion, loads=[load], frame=2, passive=True)
        return found.velocity.sum((-2, -1)), found.loads

    assert torch.autograd.gradcheck(share, (q, qd, tau, force))


@pytest.mark.parametrize(
    ("given", "kind", "message"),
    [
        (
            {},
            TypeError,
            r"^give tau, the torques of the actuators, or qdd, the acceleration that they are to",
        ),
        ({"tau": [0, 0, 0], "qdd": [0, 0, 0]}, TypeError, r"one of the two$"),
        ({"tau": [0, 0]}, ValueError, r"^tau has shape \(2,\); its last axis must be 3"),
        ({"tau": [0, 0, 0], "frame": "hand"}, ValueError, r"^frame is 'hand', which is not there"),
        ({"tau": [0, 0, 0], "point": [0, 0, 0]}, ValueError, r"^point is given without the frame"),
        (
            {"tau": [0, 0, 0], "point": [0, 0, 0], "frame": "centre of mass"},
            ValueError,
            r"^point is given for the centre of mass, which has none",
        ),
        ({"tau": [0, 0, 0], "loads": [[0, 0, 1.0]]}, TypeError, r"^loads\[0\] is a list; give AppliedLoad\("),
    ],
)
def test_what_is_wrong_is_named(
    given: dict[str, Any], kind: type[Exception], message: str, package_of: Packages
) -> None:
    robot = package_of(CRANE).load("numpy")
    with pytest.raises(kind, match=message):
        robot.induced_accelerations([0.1, 0.2, 0.3], [0, 0, 0], **given)


def test_a_load_that_is_wrong_is_named_by_its_number(package_of: Packages) -> None:
    package = package_of(CRANE)
    loads = [package.AppliedLoad(1, [0, 0, 1.0]), package.AppliedLoad("crate", [0, 0, 1.0])]
    with pytest.raises(ValueError, match=r"^loads\[1\]: frame is 'crate', which is not there"):
        package.load("numpy").induced_accelerations([0, 0, 0], [0, 0, 0], [0, 0, 0], loads=loads)
    with pytest.raises(ValueError, match=r"^nothing reacts on crane: it has no constraints"):
        package.load("numpy").induced_reactions([0, 0, 0], [0, 0, 0], [0, 0, 0])
