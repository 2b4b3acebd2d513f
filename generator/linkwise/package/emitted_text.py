"""What a package's own files may say, read as text before anything of them runs.

A hash tells that a file is as its manifest lists it, not that it came from here: whoever sends a package can
write both anew. What linkwise emits says little: arithmetic, sines and the like, and records of its runtime.
So these files are read by that small grammar, and refused with the line where they say anything else. Files
that are the same in every package are compared with those of this version, byte for byte.
"""

import ast
import builtins
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib.resources import files
from pathlib import Path

from linkwise.version import VERSION

RUNTIME = "runtime."
"""Of a package, as relative imports name it."""


def _table(lines: str) -> Mapping[str, frozenset[str]]:
    """Modules, each followed by the names that may be imported from it."""
    pairs = (line.split(": ") for line in lines.split(";"))
    return {module: frozenset(names.split()) for module, names in pairs}


@dataclass(frozen=True)
class Grammar:
    """What a Python file of a package may hold beside names that it gives something to itself.

    imports: names by module, those of the package's own after "runtime."; whole: libraries, under which name
    builtins, attributes: which may be named and asked for; nodes: of the syntax
    """

    imports: Mapping[str, frozenset[str]]
    whole: Mapping[str, str]
    builtins: frozenset[str]
    attributes: frozenset[str]
    nodes: tuple[type[ast.AST], ...]


FUNCTIONS = frozenset(
    ("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log", "sqrt", "abs", "sign")
)
"""What may be asked of a library of arrays, and of xp, which stands for one."""
PLAIN = (
    *(ast.Module, ast.Expr, ast.ImportFrom, ast.Import, ast.alias, ast.Assign, ast.AnnAssign),
    *(ast.FunctionDef, ast.Return, ast.arguments, ast.arg, ast.keyword, ast.Constant, ast.Name),
    *(ast.Attribute, ast.Subscript, ast.Tuple, ast.List, ast.Dict, ast.BinOp, ast.UnaryOp, ast.Call),
    *(ast.operator, ast.unaryop, ast.expr_context),
)
ARITHMETIC = Grammar(
    imports=_table(
        "math: inf;typing: Any;collections.abc: Mapping;runtime.interface: ClosedForms"
        ";runtime.lagrangians.energy_interface: Parameters Values"
        ";runtime.lagrangians.partial_lagrangian: PartialLagrangian"
        ";runtime.lagrangians.frame_motion: GROUND Axes along_z potential_at velocity_at"
        ";runtime.lagrangians.joint_curve: JointCurve;runtime.lagrangians.lanes: carried"
        ";runtime.lagrangians.rigid_body: kinetic_energy"
        ";runtime.lagrangians.rigid_lagrangian: RigidLagrangian;runtime.file_joints: FileJoint"
        ";runtime.parameter_values: ParametricBody;runtime.passive_joints: PassiveJoint"
        ";runtime.structure: JointLimits Structure;runtime.rule.rule_calls: RigidRule"
        ";runtime.rule.joint_tree: JointTree TreeCoupling TreeCurve TreeFrame TreeJoint TreeLink TreeTie"
    ),
    whole={"torch": "torch", "numpy": "np"},
    builtins=frozenset(("tuple", "type", "int", "float", "str", "dict")),
    attributes=frozenset(
        (
            *("before", "twist", "height", "body", "kinetic", "potential", "constants"),
            *("turn", "slide", "slope", "Lagrangian"),
        )
    ),
    nodes=(*PLAIN, ast.ClassDef, ast.Lambda, ast.Slice),
)
"""Of closed forms, energies, names and the tree."""
LOADING = Grammar(
    imports=_table(
        "typing: TYPE_CHECKING Any Literal overload;collections.abc: Callable Iterable Mapping"
        ";pathlib: Path;names: ROBOT;tree: RULE;forms: LINKS;energies: LAGRANGIANS"
        ";runtime.controllers: FrameImpedance Natural Target;runtime.dynamics: Dynamics"
        ";runtime.interface: Backend;runtime.structure: Layout;runtime.rule.joint_tree: Bodies"
        ";runtime.motion_quantities: AppliedLoad InducedAccelerations Trajectory"
        ";runtime.quantities: Coefficients GradientPropagation Packed PassiveTorque Propagation"
        ";runtime.robot_constraints: Contact;runtime.rule.regressors: inertial_parameters"
        ";runtime.lagrangians.dynamics_module: DynamicsModule backend_of_links"
        ";runtime.arrays.array_kernels: refuse_choice refuse_learning"
        ";runtime.arrays.numpy_backend: NumpyBackend;runtime.arrays.torch_backend: TorchBackend"
        ";runtime.native.native_backend: NativeBackend"
    ),
    whole={},
    builtins=frozenset(("tuple", "type", "bool", "str", "dict", "ValueError")),
    attributes=frozenset(["parameters", "joint_names", "link_names", "bodies", "join", "face", "values"]),
    nodes=(
        *(*PLAIN, ast.If, ast.Raise, ast.JoinedStr, ast.FormattedValue, ast.Compare, ast.cmpop),
        *(ast.BoolOp, ast.boolop),
    ),
)
"""Of the package's __init__.py."""
OWN_C = "Path(__file__).parent / 'c'"
"""Where the C is that it has compiled."""
MAKING = ("_MAKERS[backend]", "(made.face or Dynamics)", "made.face or Dynamics")
"""What else it calls: each of them is named in it."""
BUILTINS = frozenset(dir(builtins))
ORDINARY = "arithmetic, sines and the like, and names"


def foreign(directory: Path, listed: Iterable[str], name: str, version: str | None) -> list[str]:
    """What in the listed files linkwise does not write, each with its file and line; empty if nothing.

    version: the one that wrote the package; files of another's runtime are not at hand to compare with.
    Raises OSError for a file that cannot be read.
    """
    found = []
    for path in listed:
        told = foreign_text(path, (directory / path).read_bytes(), name, version)
        found += [] if told is None else [f"{path} {told}"]
    return found


@lru_cache(maxsize=1024)
def foreign_text(path: str, text: bytes, name: str, version: str | None) -> str | None:
    """The same of one file, what is wrong with it alone; None if nothing."""
    own = own_text(path)
    if own is not None or path.startswith("runtime/"):
        return None if version != VERSION or own == text else f"is not that of linkwise {VERSION}"
    ending = path.rpartition(".")[2]
    try:
        if ending == "py":
            return next(_python(LOADING if path == "__init__.py" else ARITHMETIC, text.decode()), None)
        return next(_c(text.decode(), name), None) if ending in ("h", "c") else None
    except (SyntaxError, ValueError, RecursionError) as error:
        return f"cannot be read ({' '.join(str(error).split())})"


@cache
def own_text(path: str) -> bytes | None:
    """The file of linkwise that a package has a copy of at this path; None where that is no copy."""
    folder, _, name = path.partition("/")
    places = {"runtime": files("linkwise.runtime"), "c": files("linkwise.runtime").joinpath("c")}
    if folder in places and (file := places[folder].joinpath(name)).is_file():
        return file.read_text(encoding="utf-8").encode()  # as it was written, whatever ends lines here
    return None


def _python(grammar: Grammar, text: str) -> Iterator[str]:
    """What a module of a package says beside what its grammar allows."""
    tree = ast.parse(text)
    known = _bound(tree) | grammar.builtins
    own_c = {id(part) for node in ast.walk(tree) if _is_own_c(node) for part in ast.walk(node)}
    for node in ast.walk(tree):
        if (grammar is not LOADING or id(node) not in own_c) and (told := _beside(node, grammar, known)):
            yield f"line {getattr(node, 'lineno', 1)} {told}, where linkwise writes {ORDINARY} alone"


def _is_own_c(node: ast.AST) -> bool:
    return isinstance(node, ast.BinOp) and isinstance(node.op, ast.Div) and ast.unparse(node) == OWN_C


def _bound(tree: ast.Module) -> set[str]:
    """Names that the module itself gives something to."""
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


def _beside(node: ast.AST, grammar: Grammar, known: set[str]) -> str:
    """What is wrong with a node, in words; empty if nothing."""
    if not isinstance(node, grammar.nodes):
        return f"has {type(node).__name__}"
    match node:
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
            return "" if name in known else f"names {name}"
        case ast.Name(id=name) | ast.arg(arg=name) | ast.FunctionDef(name=name) | ast.ClassDef(name=name):
            taken = name in BUILTINS or name in grammar.whole.values()
            return f"gives {name} another meaning" if taken or (name[:2] == "__" != name[-2:]) else ""
        case ast.Attribute(value=ast.Name(id="xp" | "torch" | "np"), attr=attribute):
            return "" if attribute in FUNCTIONS else f"asks for .{attribute}"
        case ast.Attribute(attr=attribute):
            return "" if attribute in grammar.attributes else f"asks for .{attribute}"
        case ast.Call(func=ast.Name() | ast.Attribute() | ast.Call()):
            return ""
        case ast.Call(func=func):
            return "" if ast.unparse(func) in MAKING else "calls what an expression gives"
    return ""


def _may_import(grammar: Grammar, module: str, name: str, level: int) -> bool:
    if level and not module:
        return re.fullmatch(r"link_\d+", name) is not None
    inside = module.startswith(RUNTIME) or module in ("names", "tree", "forms", "energies")
    return name in grammar.imports.get(module, ()) and (level > 0) == inside


C_TOKEN = re.compile(
    r"""(?P<comment>/\*.*?\*/|//[^\n]*)|(?P<include>^[ \t]*\#[ \t]*include\b[^\n]*)
    |(?P<pasting>^[^\n]*\#\#[^\n]*)|(?P<string>"(?:[^"\\\n]|\\.)*")
    |(?P<word>[A-Za-z_]\w*)|(?P<number>\.?\d(?:[eEpP][-+]|[\w.])*)|(?P<quote>["'])
    |(?P<called>[])][ \t\n]*\()""",
    re.DOTALL | re.MULTILINE | re.VERBOSE,
)
DECLARED = re.compile(r"\b(?:real|int|short|char|size_t|double|float)\s+\**\s*(?:RESTRICT\s+)?(\w+)")
PASTING = re.compile(r"#define (?:SIZED\(name\) name##_\w+|API\(function\) F\(\w+_##function\))")
MADE = re.compile(r"\b(?:KERNEL|API|F|SIZED)\(\w*$")
"""Before the bracket that ends it: a name that a macro makes, which may be called."""
OF_LINK = re.compile(r"links?_\d+(?:_\w+)?|at_p_\w+")
JINJA = re.compile(r"\{[{%#].*?[}%#]\}", re.DOTALL)
TAKEN = frozenset(("asm", "__asm__", "__asm", "goto"))
HEADERS = frozenset(("math.h", "stddef.h"))


def _c(text: str, name: str) -> Iterator[str]:
    """What a C file of a package says beside the vocabulary of linkwise's own C and local numbers.

    Words that neither that nor the robot's name has are numbers declared in the file, and never called.
    """
    words, calls = _c_vocabulary()
    robots = (f"{name}_", f"{name.upper()}_", f"LINKWISE_{name.upper()}")
    local = set(DECLARED.findall(text))
    for token in C_TOKEN.finditer(text):
        what, told = token[0], ""
        match token.lastgroup:
            case "word" if not (what.startswith(robots) or OF_LINK.fullmatch(what)):
                called = re.match(r"\s*\(", text[token.end() : token.end() + 80])
                if what in TAKEN or (what not in words and (called or what not in local)):
                    told = f"names {what}"
                elif called and what not in calls:
                    told = f"calls {what}"
            case "include":
                told = "" if _is_own(what, name) else f"has {' '.join(what.split())}"
            case "pasting":
                told = "" if PASTING.fullmatch(what.strip()) else f"has {' '.join(what.split())}"
            case "quote":
                told = "has a string that does not end"
            case "called":
                told = "" if MADE.search(text[: token.start()][-80:]) else "calls what an expression gives"
        if told:
            line = text.count("\n", 0, token.start()) + 1
            yield f"line {line} {told}, where linkwise writes {ORDINARY} alone"


def _is_own(include: str, name: str) -> bool:
    """Whether an include is of the package's own files, or of one of HEADERS."""
    file = include.partition("include")[2].split("/*")[0].strip()[1:-1]
    robots = re.fullmatch(rf"(?:link_\d+|{re.escape(name)}f?(?:_\w+)?)\.[ch]", file)
    return file in HEADERS or robots is not None or own_text(f"c/{file}") is not None


@cache
def _c_vocabulary() -> tuple[frozenset[str], frozenset[str]]:
    """Words of linkwise's own C, and those of them that stand before a bracket."""
    folders = (files(place).joinpath("c") for place in ("linkwise.runtime", "linkwise.templates"))
    own = (file for folder in folders for file in folder.iterdir() if file.name.endswith((".h", ".j2")))
    plain = JINJA.sub(" ", "\n".join(file.read_text(encoding="utf-8") for file in own))
    plain = re.sub(r"/\*.*?\*/|//[^\n]*", " ", plain, flags=re.DOTALL)
    words = re.findall(r"[A-Za-z_]\w*", plain)
    return frozenset((*words, *FUNCTIONS, "HUGE_VAL")), frozenset(re.findall(r"([A-Za-z_]\w*)\s*\(", plain))
