"""Names from files go through one rule for each kind of place, and come out as the text that they are."""

import ast
import base64
import csv
import gzip
import html.parser
import json
import re
import tokenize
import unicodedata
import warnings
from dataclasses import replace
from io import BytesIO, StringIO
from pathlib import Path

import pytest
from conftest import needs_compiler
from helpers.compiled import STRICT
from helpers.kept import run_kept
from helpers.motion_logs import PLANAR3, smooth, write_csv
from linkwise import Options, generate, read_system, write_package
from linkwise import escape as to
from linkwise.analysis import analyze
from linkwise.analysis.result_rows import ResultRows, torque_places
from linkwise.analysis.show import figure_bytes
from linkwise.analysis.show.page import report
from linkwise.analysis.term_rows import term_rows
from linkwise.package.load import import_package
from linkwise.plotstyle import drawn
from linkwise.render import render
from markdown_it import MarkdownIt

from house.test_names import chain

EVIL = (
    "../../x",
    "class",
    "a\nb\r\nc",
    'a"b',
    "a\\",
    "'''",
    '"""',
    "{{7*7}}{% raw %}",
    "*/ #include <x> /*",
    "/*/ ??/ ???/",
    "\\\n",
    "</script><script>document.title=1</script>",
    "<img src=x onerror=alert(1)>&lt;",
    "$x^",
    "$\\frac{$ ^^M",
    "%{x} %{customdata}",
    "\x1b[31mred\x9b0m",
    "\u202eabc\u2066",
    "a\u2028\x85\x0bb",
    "=cmd()|x",
    "a|b`c`\\|d",
    "_a_ *b* [c](d) ![e](f) :smile: ~~g~~ #",
    "\\end{document}\\input{/etc/passwd}",
    "a%2Fb/c",
    "a,b;c\td",
    "日本語 ∂τ",
    "x" * 300,
    "\0",
)


def seen(text: str) -> bool:
    """Return whether people see every character of a text, and none orders what comes after."""
    return not {unicodedata.category(c) for c in text} & {"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"}


@pytest.mark.parametrize("name", EVIL, ids=ascii)
def test_plain_text_is_one_line_that_shows_every_character(name: str) -> None:
    text = to.printable(name)
    assert seen(text)
    if not any(c in name for c in "\\\u3000"):
        assert text.encode("raw_unicode_escape").decode("unicode_escape") == name


@pytest.mark.parametrize("name", EVIL, ids=ascii)
def test_markdown_shows_the_name_in_one_cell(name: str) -> None:
    document = f"# On {to.markdown(name)}\n\n| a | b |\n|---|---|\n| {to.markdown(name)} | 1 |\n"
    heading, cell, other = _inline(document)
    assert heading == f"On {to.printable(name)}".strip()
    assert (cell, other) == (to.printable(name).strip(), "1")


def _inline(document: str) -> list[str]:
    """Text of the heading and of the row's cells; whatever is markup in them fails."""
    tokens = MarkdownIt("commonmark").enable(["table", "strikethrough"]).parse(document)
    texts = []
    for token in tokens:
        if token.type == "inline":
            assert {child.type for child in token.children} <= {"text", "text_special"}, token.content
            texts.append("".join(child.content for child in token.children))
    heading, _, _, *cells = texts
    return [heading, *cells]


@pytest.mark.parametrize("name", EVIL, ids=ascii)
def test_json_comes_back_and_shows_every_character(name: str) -> None:
    text = to.json_text({name: [name]}, indent=1)
    assert json.loads(text) == {name: [name]}
    assert seen(text.replace("\n", ""))
    embedded = to.script_data([name])
    assert json.loads(embedded) == [name]
    assert embedded.isascii()
    assert not re.search("[<>&]", embedded)


def test_json_has_no_nan() -> None:
    with pytest.raises(ValueError, match="not JSON compliant"):
        to.json_text(float("nan"))


def test_json_to_read_has_letters_as_they_are_and_escapes_for_what_nobody_sees() -> None:
    assert to.json_text("Größe 角\u202e") == '"Größe 角\\u202e"'


@pytest.mark.parametrize("name", EVIL, ids=ascii)
def test_python_takes_it_for_a_string_and_a_docstring(name: str) -> None:
    assert ast.literal_eval(to.python_literal(name)) == name
    module = ast.parse(f'"""Of {to.python_docstring(name)}"""\n')
    assert ast.get_docstring(module, clean=False) == f"Of {to.python_literal(name)}"


@needs_compiler
def test_c_comments_hold_every_name_as_c_and_as_cpp(tmp_path: Path) -> None:
    lines = [f"/* {to.c_comment(name)} */" for name in EVIL]
    assert all(line.isascii() and "??" not in line for line in lines)
    (tmp_path / "a.c").write_text("\n".join([*lines, "int nothing(void);"]) + "\n")
    for compiler in (["gcc", "-std=c99", "-Wcomment", "-Wtrigraphs"], ["g++", "-x", "c++", "-std=c++17"]):
        run_kept([*compiler, *STRICT, "-fsyntax-only", tmp_path / "a.c"])


def test_identifiers_are_told_apart_and_fit_every_compiler() -> None:
    names = [*EVIL, "a b", "a_b", "a-b", "x" * 301]
    made = to.identifiers(names, "p_")
    assert len(set(made)) == len(names)
    assert all(name.isidentifier() and name.isascii() and name.startswith("p_") for name in made)
    assert all(len(name) <= 63 for name in made)


def test_files_and_columns_have_names_of_their_own() -> None:
    for rule in (to.file_name, to.column_part):
        made = [rule(name) for name in EVIL]
        assert len(set(made)) == len(EVIL)
        assert all(seen(name) and "/" not in name for name in made)
    assert all(len(to.file_name(name)) < 100 for name in EVIL)
    assert [to.file_name("knee_left"), to.column_part("knee left")] == ["knee_left", "knee left"]


def test_a_list_names_the_first_and_counts_the_others() -> None:
    assert to.listed("abc") == "a, b, c"
    assert to.listed(range(215), 3) == "0, 1, 2 and 212 more"
    assert len(to.listed(["x" * 300] * 1000)) < 600


class Page(html.parser.HTMLParser):
    """Page as an HTML parser reads it: its title, its elements, the content of each script."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.title, self.scripts, self.tags = "", [], []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        if tag == "script":
            self.scripts.append("")

    def handle_data(self, data):
        if self.tags and self.tags[-1] == "title" and not self.title:
            self.title = data
        elif self.lasttag == "script" and self.cdata_elem == "script":
            self.scripts[-1] += data


@pytest.fixture(scope="module")
def analysis(tmp_path_factory):
    return analyze(write_csv(tmp_path_factory.mktemp("a") / "a.csv", smooth(30, 3)), PLANAR3)


def renamed(analysis, names, source="a.csv"):
    robot = replace(analysis.robot, name=names[0], joints=names, links=names)
    rows = ResultRows.of(robot, torque_places(robot, term_rows(robot.model.layout)))
    return replace(analysis, robot=robot, rows=rows, source=source)


@pytest.mark.parametrize("start", range(0, len(EVIL) - 2, 3))
def test_the_page_holds_names_as_text_only(start: int, analysis) -> None:
    names = EVIL[start : start + 3]
    plain = Page(report(analysis))
    page = Page(report(renamed(analysis, names, names[0])))
    assert page.tags == plain.tags
    assert page.title == f"{to.printable(names[0])} · {to.printable(names[0])}"
    data = json.loads(gzip.decompress(base64.b64decode(page.scripts[0])))
    assert [joint["name"] for joint in data["joints"]] == list(map(to.printable, names))
    assert page.scripts[1:] == plain.scripts[1:]


def test_plots_draw_names_literally_and_without_a_warning(analysis) -> None:
    assert drawn("\\frac{$") == "\\frac{$"
    assert drawn("a\n日") == r"a\n\u65e5"
    assert len(drawn("x" * 300)) == 24
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # of a character without a picture, of a legend that hides a name
        for names in (("_a\x1b", "$x^", "日本"), ("$\\frac{$ ^^M", "\u202eb", "\n")):
            assert figure_bytes(renamed(analysis, names, names[0]), "shares")
            assert figure_bytes(renamed(analysis, names, names[0]), "causes")


def test_a_templates_name_reaches_no_hover_template() -> None:
    source = (Path(__file__).parents[2] / "templates/analysis").glob("*.js.j2")
    for template in re.findall(r"(?:hover|text)template: .*", "\n".join(p.read_text() for p in source)):
        assert not re.search(r"template: `[^`]*\$\{(?!unitOf)", template), template


@pytest.fixture(scope="module")
def packages(tmp_path_factory) -> dict[str, Path]:
    """Return for each name a package of a robot, a link and a joint of that name, with symbolic
    parameters."""
    place = tmp_path_factory.mktemp("evil")
    made = {}
    for number, name in enumerate(EVIL[:-1]):
        file = place / f"{number}.toml"
        file.write_text(chain(name, (name,)), encoding="utf-8")
        system = read_system(file, Options("symbolic"))
        made[name] = place / str(number)
        write_package(generate(system, ["numpy", "c", "formulas"], "evil"), made[name])
    return made


def test_python_files_hold_names_in_strings_only(packages: dict[str, Path]) -> None:
    for name, package in packages.items():
        assert import_package(package).link_names == (name,)
        for file in package.rglob("*.py"):
            assert file.read_bytes().isascii(), file
            tokens = list(tokenize.tokenize(BytesIO(file.read_bytes()).readline))
            assert not {"system", "x" * 300} & {t.string for t in tokens if t.type == tokenize.NAME}


@needs_compiler
@pytest.mark.parametrize(
    ("compiler", "every"), [(("gcc", "-std=c99"), 1), (("g++", "-x", "c++", "-std=c++17"), 9)]
)
def test_c_files_compile_without_a_warning(
    packages: dict[str, Path], compiler: tuple[str, ...], every: int
) -> None:
    for package in list(packages.values())[::every]:
        run_kept([*compiler, *STRICT, "-fsyntax-only", package / "c" / "evil.c"])


LATEX = re.compile(r"\\(?:\[|\]|left\(|right\)|[A-Za-z]+|_)|[-+=0-9A-Za-z{}_^() .]")
MACROS = {"tau", "frac", "dot", "ddot", "sin", "cos", "left", "right", "mathrm", "sqrt"}


def test_formulas_are_lines_of_plain_text_and_of_latex_mathematics(packages: dict[str, Path]) -> None:
    for package in packages.values():
        text, latex = ((package / f"formulas.{kind}").read_text(encoding="utf-8") for kind in ("txt", "tex"))
        assert seen(text.replace("\n", ""))
        _, *formulas = re.split(r"\ntau_", text)
        for formula in formulas:
            ast.parse(f"tau_{formula}")
        assert len(formulas) == 1
        lines = [line for line in latex.split("\n") if line and not line.startswith("%")]
        assert len(lines) == 1
        for line in lines:
            assert line.startswith(r"\[ \tau_{")
            assert line.endswith(r" \]")
            assert not LATEX.sub("", line)
            assert set(re.findall(r"\\([A-Za-z]+)", line)) <= MACROS
            depth = [line[:at].count("{") - line[:at].count("}") for at in range(len(line) + 1)]
            assert min(depth) == depth[-1] == 0


def test_formulas_tell_apart_parameters_that_look_alike(tmp_path: Path) -> None:
    file = tmp_path / "alike.toml"
    text = chain("alike", ("a",)).replace("[0.1, 0.02, 0.0]", '["m1 + m_1 + q_1", "tau_11 + alpha", 0]')
    parameters = "[parameters]\nm1 = 0.1\nm_1 = 0.2\nq_1 = 0.3\ntau_11 = 0.4\nalpha = 0.5\n"
    file.write_text(text.replace("[[link]]", f"{parameters}[[link]]", 1), encoding="utf-8")
    files = generate(read_system(file, Options("symbolic")), ["formulas"])
    assert "p_q_1 is parameter 'q_1'." in files["formulas.txt"]
    assert "p_tau_11 is parameter 'tau_11'." in files["formulas.txt"]
    assert r"p_{\mathrm{m\_1}} is parameter 'm_1'." in files["formulas.tex"]
    assert r"\alpha" in files["formulas.tex"]
    assert "'alpha'" not in files["formulas.txt"]


def test_csv_header_comes_back(analysis) -> None:
    made = renamed(analysis, EVIL[16:19])
    header = StringIO()
    csv.writer(header).writerow(column.name for column in made.columns)
    assert "\n" not in header.getvalue().rstrip("\r\n")
    assert next(csv.reader([header.getvalue()])) == [column.name for column in made.columns]


def test_templates_have_the_rules_as_filters() -> None:
    view = {"robot": "a|b", "batch": 1, "machine": "<m>", "verdicts": [], "rows": [], "pictures": False}
    view |= {"derivations": [], "limit": "20"}
    text = render("report/measured.md.j2", view)
    assert "# Measured time of a\\|b\n" in text
    assert "&lt;m&gt;" in text


def test_a_text_is_cut_only_where_it_is_longer_than_it_may_be() -> None:
    assert to.short("a" * 24) == "a" * 24
    assert to.short(f"{'a' * 12}{'b' * 13}") == f"{'a' * 12}…{'b' * 11}"


def test_a_string_of_c_has_the_bytes_of_the_name_and_nothing_that_ends_it() -> None:
    assert to.c_string("left/knee") == '"left/knee"'
    assert to.c_string('a"b\\c??/*/') == r'"a\042b\134c\077\077\057*\057"'
    assert to.c_string("größe\n") == r'"gr\303\266\303\237e\012"'


def test_names_of_files_that_differ_by_case_alone_are_numbered() -> None:
    assert to.file_names(["shares-A", "shares-a", "shares-a-2", "SHARES-A"]) == [
        "shares-A",
        "shares-a-2",
        "shares-a-2-2",
        "SHARES-A-3",
    ]
