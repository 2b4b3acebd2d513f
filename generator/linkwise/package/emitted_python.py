"""Grammar of the Python that a package holds: what linkwise emits, and nothing else."""

import ast
import builtins
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from linkwise.package.emitted_c import FUNCTIONS, ORDINARY
from linkwise.package.runtime_imports import RUNTIME


def _table(lines: str) -> Mapping[str, frozenset[str]]:
    """Return modules, each with the names that may be imported from it."""
    pairs = (line.replace("RUN.", f"{RUNTIME}.").split(": ") for line in lines.split(";"))
    return {module: frozenset(names.split()) for module, names in pairs}


@dataclass(frozen=True)
class Grammar:
    """Grammar of a Python file of a package, beside names that the file itself assigns.

    imports: names by module, RUN before those of linkwise_runtime; whole: libraries, with the name of each
    builtins, attributes: those that may be named and asked for; calls: builtins that may be called, since
    types make others; nodes: of the syntax
    """

    imports: Mapping[str, frozenset[str]]
    whole: Mapping[str, str]
    builtins: frozenset[str]
    calls: frozenset[str]
    attributes: frozenset[str]
    nodes: frozenset[type[ast.AST]]


def _kinds(*types: type[ast.AST]) -> frozenset[type[ast.AST]]:
    """Return types of nodes with the types that are kinds of them, as ast.Add is of ast.operator."""
    return frozenset((*types, *(kind for one in types for kind in one.__subclasses__())))


PLAIN = (
    *(ast.Module, ast.Expr, ast.ImportFrom, ast.Import, ast.alias, ast.Assign, ast.AnnAssign),
    *(ast.FunctionDef, ast.Return, ast.arguments, ast.arg, ast.keyword, ast.Constant, ast.Name),
    *(ast.Attribute, ast.Subscript, ast.Tuple, ast.List, ast.Dict, ast.BinOp, ast.UnaryOp, ast.Call),
    *(ast.operator, ast.unaryop, ast.expr_context),
)
ARITHMETIC = Grammar(
    imports=_table(
        "math: inf;typing: Any;collections.abc: Mapping;RUN.interface: ClosedForms"
        ";RUN.lagrangians.energy_interface: Parameters Values"
        ";RUN.lagrangians.partial_lagrangian: PartialLagrangian RigidLagrangian kinetic_energy"
        ";RUN.lagrangians.written_lagrangian: WrittenLagrangian"
        ";RUN.lagrangians.frame_motion: GROUND Axes JointCurve along_z potential_at velocity_at"
        ";RUN.lagrangians.lanes: carried"
        ";RUN.file_joints: FileJoint;RUN.parameter_values: ParametricBody"
        ";RUN.structure: JointLimits PassiveJoint Structure WrittenConstraints"
        ";constraints: positions rates;RUN.rule.calls: RigidRule"
        ";RUN.rule.joint_tree: JointTree ParametricTree TreeCoupling TreeCurve TreeFrame TreeJoint TreeLink"
        " TreeTie"
    ),
    whole={"torch": "torch", "numpy": "np"},
    builtins=frozenset(("tuple", "type", "int", "float", "str", "dict")),
    calls=frozenset(),
    attributes=frozenset(
        (
            *("before", "twist", "height", "body", "kinetic", "potential", "constants"),
            *("turn", "slide", "slope", "Lagrangian"),
        )
    ),
    nodes=_kinds(*PLAIN, ast.ClassDef, ast.Lambda, ast.Slice, ast.Compare) | {ast.Lt, ast.LtE},
)
"""Grammar of closed forms, energies, names and the tree."""
LOADING = Grammar(
    imports=_table(
        "typing: TYPE_CHECKING Any Literal overload;collections.abc: Callable Iterable Mapping"
        ";pathlib: Path;names: ROBOT;tree: RULE;forms: LINKS;energies: LAGRANGIANS"
        ";RUN.version: require require_as_imported;RUN.targets: FrameImpedance Grip Natural Target"
        ";RUN.dynamics: Dynamics"
        ";RUN.arrays.backend: ArrayBackend refuse_choice refuse_learning"
        ";RUN.structure: Layout;RUN.rule.joint_tree: Bodies"
        ";RUN.quantities: AppliedLoad Coefficients Contact GradientPropagation InducedAccelerations Packed"
        " PassiveTorque Propagation Trajectory"
        ";RUN.rule.regressors: inertial_parameters"
        ";RUN.lagrangians.dynamics_module: DynamicsModule backend_of_links"
        ";RUN.arrays.numpy_backend: NumpyBackend;RUN.arrays.torch_backend: TorchBackend"
        ";RUN.native.backend: NativeBackend"
    ),
    whole={},
    builtins=frozenset(("tuple", "type", "bool", "str", "dict", "ValueError")),
    calls=frozenset(("tuple", "dict", "ValueError")),
    attributes=frozenset(["parameters", "joint_names", "link_names", "bodies", "join", "face", "values"]),
    nodes=_kinds(
        *(*PLAIN, ast.If, ast.Raise, ast.JoinedStr, ast.FormattedValue, ast.Compare, ast.cmpop),
        *(ast.BoolOp, ast.boolop),
    ),
)
"""Grammar of the package's __init__.py."""
OWN_PLACES = ("Path(__file__).parent / 'c'", "require_as_imported(ROBOT, __file__)")
"""Expressions with its own place: for the folder of the C that it compiles, and to be found as imported."""
MAKING = ("_MAKERS[backend]", "(made.face or Dynamics)", "made.face or Dynamics")
"""Further expressions that it calls: each of them is named in it."""
OF_LIBRARY = FUNCTIONS | {"where", "full_like"}
"""Functions of NumPy and torch that formulas call."""
BUILTINS = frozenset(dir(builtins))
OPERATORS = (ast.Add, ast.Sub, ast.Mult, ast.Div, ast.Pow, ast.BitOr)
"""Operators of numbers, and of types."""


def foreign_python(path: str, text: bytes) -> Iterator[str]:
    """Yield what a module of a package says beside what its grammar allows, each with its line.

    It is parsed from bytes, as by Python: a comment in them may say in what encoding they are.
    """
    grammar = LOADING if path == "__init__.py" else ARITHMETIC
    nodes = list(ast.walk(ast.parse(text)))
    known = ModuleNames.of(nodes, grammar)
    own = {id(part) for node in nodes if _is_own_place(node) for part in ast.walk(node)}
    for node in nodes:
        if (grammar is not LOADING or id(node) not in own) and (told := _beside(node, grammar, known)):
            yield f"line {getattr(node, 'lineno', 1)} {told}, where linkwise writes {ORDINARY} alone"


def _is_own_place(node: ast.AST) -> bool:
    return isinstance(node, ast.BinOp | ast.Call) and ast.unparse(node) in OWN_PLACES


@dataclass(frozen=True)
class ModuleNames:
    """Names of a module: all that it may use, functions and classes, and those of numbers and text alone."""

    names: set[str]
    functions: set[str]
    fixed: set[str]

    @classmethod
    def of(cls, nodes: Sequence[ast.AST], grammar: Grammar) -> "ModuleNames":
        """Return the names of a module, whose statements come before those of its functions."""
        names, functions, fixed = set(grammar.builtins), set[str](), set[str]()
        for node in nodes:
            match node:
                case ast.Name(id=name, ctx=ast.Store()) | ast.arg(arg=name):
                    names.add(name)
                case ast.FunctionDef(name=name) | ast.ClassDef(name=name):
                    names.add(name)
                    functions.add(name)
                case ast.alias(name=name, asname=other):
                    names.add(other or name)
                case ast.Assign(value=value) | ast.AnnAssign(value=ast.expr() as value):
                    functions |= set(_named(node, ast.Store)) if isinstance(value, ast.Lambda) else set()
                    fixed |= set(_named(node, ast.Store)) if fixed.issuperset(_named(value)) else set()
        return cls(names, functions, fixed)

    def are_fixed(self, node: ast.AST) -> bool:
        """Return whether all names in a node are of numbers and text."""
        return all(name in self.fixed for name in _named(node))


def _named(node: ast.AST, how: type[ast.expr_context] = ast.expr_context) -> Iterator[str]:
    return (part.id for part in ast.walk(node) if isinstance(part, ast.Name) and isinstance(part.ctx, how))


def _beside(node: ast.AST, grammar: Grammar, known: ModuleNames) -> str:
    """Return what is wrong with a node, in words; empty if nothing."""
    kind = type(node)
    if kind not in grammar.nodes:
        return f"has {kind.__name__}"
    return CHECKS[kind](node, grammar, known) if kind in CHECKS else ""


def _class(node: ast.ClassDef, grammar: Grammar, known: ModuleNames) -> str:
    return "has a class of another kind" if node.keywords else _defined(node.name, grammar)


def _function(node: ast.FunctionDef, grammar: Grammar, known: ModuleNames) -> str:
    return _defined(node.name, grammar)


def _argument(node: ast.arg, grammar: Grammar, known: ModuleNames) -> str:
    return _defined(node.arg, grammar)


def _name(node: ast.Name, grammar: Grammar, known: ModuleNames) -> str:
    if node.id in ("Path", "__file__"):
        return "names a file"
    if isinstance(node.ctx, ast.Load):
        return "" if node.id in known.names else f"names {node.id}"
    return _defined(node.id, grammar)


def _defined(name: str, grammar: Grammar) -> str:
    taken = name in BUILTINS or name in grammar.whole.values()
    own = name[:2] == "__" and name != "__all__"  # Python's own: __builtins__ is what all names mean
    return f"gives {name} another meaning" if taken or own else ""


def _import(node: ast.Import, grammar: Grammar, known: ModuleNames) -> str:
    wrong = [alias for alias in node.names if grammar.whole.get(alias.name) != (alias.asname or alias.name)]
    return f"imports {wrong[0].name}" if wrong else ""


def _import_from(node: ast.ImportFrom, grammar: Grammar, known: ModuleNames) -> str:
    module = node.module or ""
    for alias in node.names:
        if alias.asname or not _may_import(grammar, module, alias.name, node.level):
            return f"imports {alias.name} from {'.' * node.level}{module}"
    return ""


def _subscript(node: ast.Subscript, grammar: Grammar, known: ModuleNames) -> str:
    return "changes a part of what there is" if isinstance(node.ctx, ast.Store) else ""


def _attribute(node: ast.Attribute, grammar: Grammar, known: ModuleNames) -> str:
    if isinstance(node.ctx, ast.Store):
        return "changes a part of what there is"
    of_library = isinstance(node.value, ast.Name) and node.value.id in ("xp", "torch", "np")
    return "" if node.attr in (OF_LIBRARY if of_library else grammar.attributes) else f"asks for .{node.attr}"


def _arithmetic(node: ast.BinOp, grammar: Grammar, known: ModuleNames) -> str:
    operands, operator = (node.left, node.right), node.op
    # A division of a path leads to other files; those of OWN_PLACES are passed over.
    if isinstance(operator, ast.Div) and grammar is LOADING:
        return "does what is no arithmetic"
    several = not isinstance(operator, ast.Div) and any(map(_is_several, operands))
    if several or not isinstance(operator, OPERATORS):
        return "does what is no arithmetic"
    # A power of numbers alone may fill the memory; so may products of products, or of text.
    if isinstance(operator, ast.Pow) and known.are_fixed(node.left):
        return "has a power of numbers"
    # What an operand computes is checked by itself.
    of_numbers = all(not isinstance(part, ast.BinOp) and known.are_fixed(part) for part in operands)
    return "computes with numbers alone" if of_numbers and any(_named(node)) else ""


def _is_several(node: ast.AST) -> bool:
    """Return whether a node is text or a list, whose product with a number may be as long as memory."""
    if isinstance(node, ast.Constant):
        return isinstance(node.value, str | bytes)
    return isinstance(node, ast.Tuple | ast.List | ast.Dict | ast.JoinedStr)


def _call(node: ast.Call, grammar: Grammar, known: ModuleNames) -> str:
    match node.func:
        case ast.Name(id=name) if name in known.functions:
            return f"calls its own {name}"
        case ast.Name(id=name) if name in grammar.builtins - grammar.calls:
            return f"calls {name}"
        case ast.Name() | ast.Attribute() | ast.Call():
            return ""
        case function:
            return "" if ast.unparse(function) in MAKING else "calls what an expression gives"


CHECKS: Mapping[type[ast.AST], Callable[..., str]] = {
    **{ast.ClassDef: _class, ast.FunctionDef: _function, ast.arg: _argument, ast.Name: _name},
    **{ast.Import: _import, ast.ImportFrom: _import_from, ast.Subscript: _subscript},
    **{ast.Attribute: _attribute, ast.BinOp: _arithmetic, ast.Call: _call},
}
"""Further checks of a node that its grammar has, by its type."""


def _may_import(grammar: Grammar, module: str, name: str, level: int) -> bool:
    if level and not module:
        return re.fullmatch(r"link_\d+", name) is not None
    own = module in ("names", "tree", "forms", "energies", "constraints")
    right = module.startswith(f"{RUNTIME}.") or (level > 0) == own
    return name in grammar.imports.get(module, ()) and right
