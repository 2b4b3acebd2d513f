"""Table of the checks of each back end."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from linkwise_runtime.dynamics import Dynamics

from linkwise.check.compare import Result
from linkwise.check.constraint_checks import loop_calls
from linkwise.check.derivations import recorded_parts
from linkwise.check.frame_checks import frame_calls
from linkwise.check.impedance_checks import impedance_calls
from linkwise.check.induced_checks import induced_calls
from linkwise.check.model_calls import Named, against_reference
from linkwise.check.passive_checks import passive_calls
from linkwise.check.regressor_checks import regressor_calls
from linkwise.check.simulation_checks import simulation_calls
from linkwise.check.subject import BackendVariant, Subject, there
from linkwise.check.sum_checks import sums_against_reference


@dataclass(frozen=True)
class Check:
    """Calls of a back end that are compared with one reference.

    title: reported where the check itself does not run to its end
    run: yields the results, given the subject, the back end's label and its model
    by_rule: whether the check also concerns the vectorised rule; it does not where calls are composed of
    answers that were checked for both kernels
    composed: whether its calls are composed of coefficients and torques alike for every back end
    of: whether the check applies to a subject and a back end
    """

    title: str
    run: Callable[[Subject, str, Dynamics], Iterator[Result]]
    by_rule: bool = False
    composed: bool = True
    of: Callable[[Subject, BackendVariant], bool] = lambda subject, way: True

    def concerns(self, subject: Subject, way: BackendVariant) -> bool:
        """Return whether this back end of this package has such calls."""
        return (self.by_rule or way.kernel != "rule") and self.of(subject, way)


def _is_rigid(subject: Subject, way: BackendVariant) -> bool:
    return subject.tree is not None


CHECKS = (
    Check(
        "coefficients and torques",
        lambda s, name, model: against_reference(Named(name, model, s.rows, s.reference), s.manifest),
        by_rule=True,
        composed=False,
    ),
    Check(
        "recorded graphs",
        lambda s, name, model: iter([recorded_parts(Named(name, model, s.rows, s.reference))]),
        composed=False,
        of=lambda s, way: way.backend == "autograd",
    ),
    Check(
        "sums over the links",
        lambda s, name, model: sums_against_reference(name, model, s.reference),
        by_rule=True,
    ),
    Check(
        "regressors",
        lambda s, name, model: regressor_calls(name, model, there(s.regressors)),
        by_rule=True,
        of=lambda s, way: s.tree is not None and s.loaded[way].backend.rule is not None,
    ),
    Check("frames", lambda s, name, model: frame_calls(name, model, there(s.frames)), of=_is_rigid),
    Check(
        "constraints",
        lambda s, name, model: loop_calls(name, model, there(s.loops)),
        of=lambda s, way: s.loops is not None,
    ),
    Check(
        "contacts",
        lambda s, name, model: s.contacts.calls(name, model, s.package.module.Contact),
        of=lambda s, way: s.closed_states is not None,
    ),
    Check(
        "a simulated motion",
        lambda s, name, model: simulation_calls(name, model, s.simulation),
        of=lambda s, way: s.closed_states is not None,
    ),
    Check(
        "passive torques",
        lambda s, name, model: passive_calls(name, model, s.passive, s.reference),
        by_rule=True,
    ),
    Check(
        "induced accelerations",
        lambda s, name, model: induced_calls(
            name, model, s.passive, s.reference, s.frames, s.package.module.AppliedLoad
        ),
    ),
    Check(
        "controllers",
        lambda s, name, model: impedance_calls(name, model, s.tree, s.reference, s.package.module.Natural),
    ),
)
"""Checks of each back end, in the order in which they are reported."""
