"""From a system to kernels: the closed forms of each link."""

from operator import itemgetter

from linkwise.dynamics.euler_lagrange import euler_lagrange
from linkwise.dynamics.frame_search import MAX_AXES, FrameSearch
from linkwise.dynamics.kernel import Kernel, lowering, parameter_nodes
from linkwise.errors import within
from linkwise.progress import Progress, silent
from linkwise.symbolic.system import EnergySystem, System


def link_kernel(system: System, link: int) -> Kernel:
    """Closed forms of one link from its own path alone, whatever else the robot has."""
    with within(f"link {system.links[link].name!r}"):
        if isinstance(system, EnergySystem):
            return _energy_kernel(system, link)
        rigid = system.links[link]
        tree = [(f - 1, joint) for f, joint in enumerate(rigid.joints)]
        search = FrameSearch(system, [link], tree, [range(len(tree))])
        _, axes, origin = min([*search.central(MAX_AXES), *search.framed(MAX_AXES)], key=itemgetter(0))
        return search.build(axes, origin)


def _energy_kernel(system: EnergySystem, link: int) -> Kernel:
    lower, x = lowering(system)
    energy, path = system.links[link], system.path(link)
    lagrangian = lower.graph.sub(lower(energy.kinetic), lower(energy.potential))
    forms = euler_lagrange(lower.graph, lagrangian, path, x)
    return Kernel(lower.graph, x, parameter_nodes(system, lower), (forms,), ())


def derive(system: System, progress: Progress = silent) -> tuple[Kernel, ...]:
    """One kernel per link: its closed forms on a graph."""
    kernels = []
    for j in range(len(system.links)):
        progress("derive", j, len(system.links))
        with within(f"while deriving robot {system.name!r}"):
            kernels.append(link_kernel(system, j))
    progress("derive", len(system.links), len(system.links))
    return tuple(kernels)
