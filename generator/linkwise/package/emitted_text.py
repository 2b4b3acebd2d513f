"""Check of a package's own files, read as text before anything of them runs.

A hash shows that a file is as its manifest lists it, not that it came from here: whoever sends a package can
write both anew. What linkwise emits is limited to arithmetic, sines and the like, and records of its runtime.
So these files are read by that small grammar, and refused with the line where they say anything else. Files
that are the same in every package are compared with those of this version, byte for byte.
"""

import ast
import builtins
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from linkwise_runtime.version import VERSION

from linkwise.package.emitted_c import FUNCTIONS, ORDINARY, foreign_c, foreign_includes
from linkwise.package.manifest import Manifest
from linkwise.package.own_files import own_text
from linkwise.package.runtime_imports import RUNTIME, is_copied


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
    nodes: tuple[type[ast.AST], ...]


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
        ";RUN.lagrangians.frame_motion: GROUND Axes JointCurve along_z potential_at velocity_at"
        ";RUN.lagrangians.lanes: carried"
        ";RUN.file_joints: FileJoint;RUN.parameter_values: ParametricBody"
        ";RUN.structure: JointLimits PassiveJoint Structure;RUN.rule.calls: RigidRule"
        ";RUN.rule.joint_tree: JointTree TreeCoupling TreeCurve TreeFrame TreeJoint TreeLink TreeTie"
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
    nodes=(*PLAIN, ast.ClassDef, ast.Lambda, ast.Slice),
)
"""Grammar of closed forms, energies, names and the tree."""
LOADING = Grammar(
    imports=_table(
        "typing: TYPE_CHECKING Any Literal overload;collections.abc: Callable Iterable Mapping"
        ";pathlib: Path;names: ROBOT;tree: RULE;forms: LINKS;energies: LAGRANGIANS"
        ";RUN.version: require;RUN.targets: FrameImpedance Natural Target;RUN.dynamics: Dynamics"
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
    nodes=(
        *(*PLAIN, ast.If, ast.Raise, ast.JoinedStr, ast.FormattedValue, ast.Compare, ast.cmpop),
        *(ast.BoolOp, ast.boolop),
    ),
)
"""Grammar of the package's __init__.py."""
OWN_C = "Path(__file__).parent / 'c'"
"""Expression for the folder of the C that it compiles."""
MAKING = ("_MAKERS[backend]", "(made.face or Dynamics)", "made.face or Dynamics")
"""Further expressions that it calls: each of them is named in it."""
BUILTINS = frozenset(dir(builtins))
READ = frozenset(("formulas.txt", "formulas.tex", "py.typed"))
"""Files that nothing runs."""
OPERATORS = (ast.Add, ast.Sub, ast.Mult, ast.Div, ast.Pow, ast.BitOr)
"""Operators of numbers, and of types."""


def foreign(directory: Path, manifest: Manifest) -> list[str]:
    """Return what in a package's files linkwise does not write, each with its file and line.

    The list is empty if there is nothing. Raises OSError for a file that cannot be read.
    """
    source = Source.of(manifest)
    found = []
    for path in manifest.files:
        told = foreign_text(path, (directory / path).read_bytes(), source)
        found += [] if told is None else [f"{path} {told}"]
    return found


@dataclass(frozen=True)
class Source:
    """A manifest's description of the package that a file belongs to.

    version: the linkwise that wrote it; files of another's runtime are not at hand to compare with
    files: paths of all that are listed
    """

    name: str
    version: str | None
    files: frozenset[str]

    @classmethod
    def of(cls, manifest: Manifest) -> "Source":
        """Return the description in a package's manifest."""
        return cls(manifest.name, manifest.generator.get("linkwise"), frozenset(manifest.files))


@lru_cache(maxsize=1024)
def foreign_text(path: str, text: bytes, source: Source) -> str | None:
    """Return what in one file of a package linkwise does not write, without the path; None if nothing."""
    own, ending = own_text(path), path.rpartition(".")[2]
    try:
        if own is not None or is_copied(path):
            if source.version == VERSION and own != text:
                return f"is not that of linkwise {VERSION}"
        elif ending == "py":
            return next(_python(LOADING if path == "__init__.py" else ARITHMETIC, text), None)
        elif ending not in ("h", "c"):
            return None if path in READ else "is no file that linkwise writes"
        elif told := next(foreign_c(text.decode(), source.name), None):
            return told
        # C of the runtime is compiled with Python's headers.
        in_c = ending in ("h", "c") and not is_copied(path)
        folder = path.rpartition("/")[0]
        return next(foreign_includes(text.decode(), folder, source.files), None) if in_c else None
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:  # the last by Python's parser
        return f"cannot be read ({' '.join(str(error).split()) or 'it is nested too deeply'})"


def _python(grammar: Grammar, text: bytes) -> Iterator[str]:
    """Yield what a module of a package says beside what its grammar allows.

    It is parsed from bytes, as by Python: a comment in them may say in what encoding they are.
    """
    tree = ast.parse(text)
    known = ModuleNames.of(tree, grammar)
    own_c = {id(part) for node in ast.walk(tree) if _is_own_c(node) for part in ast.walk(node)}
    for node in ast.walk(tree):
        if (grammar is not LOADING or id(node) not in own_c) and (told := _beside(node, grammar, known)):
            yield f"line {getattr(node, 'lineno', 1)} {told}, where linkwise writes {ORDINARY} alone"


def _is_own_c(node: ast.AST) -> bool:
    return isinstance(node, ast.BinOp) and isinstance(node.op, ast.Div) and ast.unparse(node) == OWN_C


@dataclass(frozen=True)
class ModuleNames:
    """Names of a module: all that it may use, functions and classes, and those of numbers and text alone."""

    names: set[str]
    functions: set[str]
    fixed: set[str]

    @classmethod
    def of(cls, tree: ast.Module, grammar: Grammar) -> "ModuleNames":
        """Return the names of a module, whose statements are walked before those of its functions."""
        functions, fixed = set(), set[str]()
        for node in ast.walk(tree):
            match node:
                case ast.FunctionDef(name=name) | ast.ClassDef(name=name):
                    functions.add(name)
                case ast.Assign(value=value) | ast.AnnAssign(value=ast.expr() as value):
                    functions |= _named(node, ast.Store) if isinstance(value, ast.Lambda) else set()
                    fixed |= _named(node, ast.Store) if _named(value) <= fixed else set()
        return cls(_bound(tree) | grammar.builtins, functions, fixed)

    def is_fixed(self, operand: ast.AST) -> bool:
        """Return whether an operand has numbers and text alone.

        False for what is computed, whose own parts are checked.
        """
        return not isinstance(operand, ast.BinOp) and _named(operand) <= self.fixed


def _named(node: ast.AST, how: type[ast.expr_context] = ast.expr_context) -> set[str]:
    return {part.id for part in ast.walk(node) if isinstance(part, ast.Name) and isinstance(part.ctx, how)}


def _bound(tree: ast.Module) -> set[str]:
    """Return the names that the module itself defines."""
    found = set()
    for node in ast.walk(tree):
        match node:
            case ast.Name(id=name, ctx=ast.Store()) | ast.arg(arg=name):
                found.add(name)
            case ast.FunctionDef(name=name) | ast.ClassDef(name=name):
                found.add(name)
            case ast.alias(name=name, asname=other):
                found.add(other or name)
    return found


def _beside(node: ast.AST, grammar: Grammar, known: ModuleNames) -> str:
    """Return what is wrong with a node, in words; empty if nothing."""
    if not isinstance(node, grammar.nodes):
        return f"has {type(node).__name__}"
    match node:
        case ast.ClassDef(keywords=[_, *_]):
            return "has a class of another kind"
        case ast.Attribute(ctx=ast.Store()) | ast.Subscript(ctx=ast.Store()):
            return "changes a part of what there is"
        case ast.Import(names=names):
            wrong = [
                alias for alias in names if grammar.whole.get(alias.name) != (alias.asname or alias.name)
            ]
            return f"imports {wrong[0].name}" if wrong else ""
        case ast.ImportFrom(module=module, names=names, level=level):
            for alias in names:
                if alias.asname or not _may_import(grammar, module or "", alias.name, level):
                    return f"imports {alias.name} from {'.' * level}{module or ''}"
        case ast.Name(id="Path" | "__file__"):
            return "names a file"
        case ast.Name(id=name, ctx=ast.Load()):
            return "" if name in known.names else f"names {name}"
        case ast.Name(id=name) | ast.arg(arg=name) | ast.FunctionDef(name=name) | ast.ClassDef(name=name):
            taken = name in BUILTINS or name in grammar.whole.values()
            own = name[:2] == "__" and name != "__all__"  # Python's own: __builtins__ is what all names mean
            return f"gives {name} another meaning" if taken or own else ""
        case ast.Attribute(value=ast.Name(id="xp" | "torch" | "np"), attr=attribute):
            return "" if attribute in FUNCTIONS else f"asks for .{attribute}"
        case ast.Attribute(attr=attribute):
            return "" if attribute in grammar.attributes else f"asks for .{attribute}"
        case ast.BinOp(op=ast.Div()) if grammar is LOADING:
            return "does what is no arithmetic"  # except in OWN_C: a division of a path leads to other files
        case ast.BinOp(op=operator):
            several = not isinstance(operator, ast.Div) and any(map(_is_several, (node.left, node.right)))
            if several or not isinstance(operator, OPERATORS):
                return "does what is no arithmetic"
            # A power of numbers alone may fill the memory; so may products of products, or of text.
            if isinstance(operator, ast.Pow) and _named(node.left) <= known.fixed:
                return "has a power of numbers"
            of_numbers = all(known.is_fixed(part) for part in (node.left, node.right))
            return "computes with numbers alone" if of_numbers and _named(node) else ""
        case ast.Call(func=ast.Name(id=name)) if name in known.functions:
            return f"calls its own {name}"
        case ast.Call(func=ast.Name(id=name)) if name in grammar.builtins - grammar.calls:
            return f"calls {name}"
        case ast.Call(func=ast.Name() | ast.Attribute() | ast.Call()):
            return ""
        case ast.Call(func=func):
            return "" if ast.unparse(func) in MAKING else "calls what an expression gives"
    return ""


def _is_several(node: ast.AST) -> bool:
    """Return whether a node is text or a list, whose product with a number may be as long as memory."""
    if isinstance(node, ast.Constant):
        return isinstance(node.value, str | bytes)
    return isinstance(node, ast.Tuple | ast.List | ast.Dict | ast.JoinedStr)


def _may_import(grammar: Grammar, module: str, name: str, level: int) -> bool:
    if level and not module:
        return re.fullmatch(r"link_\d+", name) is not None
    own = module in ("names", "tree", "forms", "energies")
    right = module.startswith(f"{RUNTIME}.") or (level > 0) == own
    return name in grammar.imports.get(module, ()) and right
