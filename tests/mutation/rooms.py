"""Which files are changed, and which tests must notice: the room's and its users', cheap ones first.

Comparisons with checked-in bytes are in no list: they tell that a text changed, not that it became wrong.
"""

from dataclasses import dataclass
from fnmatch import fnmatch

CHECK = "tests/test_check.py"
UNTYPED = "not typed_strictly"
"""mypy, which takes longer than all other tests, tells no wrong number."""
ONE_COMPILER = f"(not compile or gcc) and not its_parts and {UNTYPED}"
"""What three more compilers warn of, gcc has."""


@dataclass(frozen=True)
class Room:
    """Files by pattern, below the project's root; tests as pytest names them, `only` as its -k chooses."""

    files: tuple[str, ...]
    tests: tuple[str, ...]
    leave: tuple[str, ...] = ()
    only: str = ""

    def holds(self, path: str) -> bool:
        """Whether a file is one of this room's."""
        return any(fnmatch(path, p) for p in self.files) and not any(fnmatch(path, p) for p in self.leave)


def _house(room: str) -> tuple[str, ...]:
    return (f"generator/linkwise/{room}/*.py", f"generator/linkwise/{room}.py")


def _cli(*tests: str) -> tuple[str, ...]:
    """Of the commands' tests, each of which begins a new Python, those of a room."""
    return tuple(f"tests/test_cli.py::test_{test}" for test in tests)


ROOMS: dict[str, Room] = {
    "expression": Room(
        _house("expression"),
        ("tests/test_expression.py", "tests/test_dynamics.py", "tests/test_user_energies.py"),
    ),
    "dynamics": Room(
        _house("dynamics"),
        (
            "tests/test_dynamics.py",
            "tests/test_robots_builtin.py",
            "tests/test_user_energies.py",
        ),
    ),
    "symbolic": Room(
        _house("symbolic"),
        (
            "tests/test_dynamics.py",
            "tests/test_user_energies.py",
            "tests/numeric/test_against_sympy.py",
            "tests/test_report_terms.py",
            f"{CHECK}::test_c_that_does_not_compile_fails_with_the_compilers_words",  # formulas
        ),
    ),
    "emit": Room(
        (*_house("emit"), "generator/linkwise/emit/c/*.py"),
        (
            "tests/test_templates.py",
            CHECK,
            "tests/test_parameters.py",
            "tests/test_runtime.py",
            "tests/test_package_import.py",
            "tests/test_names.py",
            "tests/test_escape.py",
            "tests/test_emitted_c.py",
        ),
        only=ONE_COMPILER,
    ),
    "templates": Room(
        tuple(f"templates/{kind}/*.j2" for kind in ("c", "closed_forms", "energies", "formulas", "package")),
        (
            "tests/test_templates.py",
            CHECK,
            "tests/test_package_import.py",
            "tests/test_package_calls.py",
            "tests/test_parameters.py",
            "tests/test_emitted_c.py",
        ),
        only=ONE_COMPILER,
    ),
    "check": Room(_house("check"), ("tests/test_check_sources.py", CHECK)),
    "package": Room(
        _house("package"),
        (
            "tests/test_manifest.py",
            CHECK,
            "tests/test_package_import.py",
        ),
    ),
    "runtime": Room(
        _house("runtime"),
        (
            "tests/test_package_arguments.py",
            "tests/test_package_calls.py",
            "tests/test_parameters.py",
            "tests/test_runtime.py",
            "tests/test_user_energies.py",
            "tests/test_labelled.py",
            CHECK,
            "tests/numeric/test_regressors.py",
        ),
        leave=("*/runtime/native/*.py",),
        only=UNTYPED,
    ),
    "native": Room(
        ("generator/linkwise/runtime/native/*.py",),
        (
            "tests/test_native.py",
            "tests/test_native_cache.py",
            "tests/test_other_systems.py",
            "tests/test_package_calls.py",
            "tests/test_runtime.py",
        ),
        only=UNTYPED,
    ),
    "c headers": Room(
        ("generator/linkwise/runtime/c/*.h",),
        ("tests/test_emitted_c.py", "tests/test_control_c.py", CHECK),
        only=ONE_COMPILER,
    ),
    "output": Room(
        (
            *_house("output"),
            *(f"generator/linkwise/{name}.py" for name in ("escape", "errors", "input_file")),
        ),
        (
            "tests/test_escape.py",
            "tests/test_output.py",
            "tests/test_cli_endings.py",
            *_cli("what_blocks_the_target_is_named"),
        ),
    ),
    "report": Room(
        (*_house("report"), "templates/report/*.j2"),
        (
            "tests/test_report_pages.py",
            "tests/test_report_terms.py",
            "tests/test_report_reduction.py",
            "tests/test_report_commands.py",
        ),
        leave=("*/plots.py", "*/seconds.py", "*/seconds_page.py"),
        only="not same_bytes and not users_mistake and not unwritable",  # whole commands are slow
    ),
    "analysis": Room(
        _house("analysis"),
        (
            "tests/test_analysis_derivatives.py",
            "tests/test_analysis_ends.py",
            "tests/test_analysis_samples.py",
            "tests/test_analysis_run.py",
            "tests/test_analysis_formats.py",
            "tests/test_analysis_logs.py",
            "tests/test_analysis_files.py",
            "tests/test_analysis_pictures.py",
            "tests/test_analysis_page.py",
            "tests/test_analysis_named.py",
        ),
    ),
    "identification": Room(
        _house("identification"), ("tests/test_identify.py", "tests/numeric/test_base_parameters.py")
    ),
    "robot": Room(
        (*_house("robot"), "generator/linkwise/robot/readers/*.py"),
        (
            "tests/test_robots_transforms.py",
            "tests/test_robots_names.py",
            "tests/test_robots_builtin.py",
            "tests/test_robots_bad.py",
            "tests/test_robots_joints.py",
            "tests/test_robots_mjcf.py",
            "tests/test_robots_mjcf_options.py",
            "tests/test_parameters.py",
            "tests/numeric/test_parameters_of_file.py",
            *_cli(
                "inspect_prints_a_table",
                "inspect_names_what_was_merged_locked_and_ignored",
                "inspect_lists_what_each_joint_leaves_out_on_request",
                "inspect_shows_a_robot_that_generate_refuses_for_a_body_that_cannot_be",
                "generate_warns_of_what_the_torques_leave_out",
                "generate_warns_of_a_floating_base_and_of_bodies_that_cannot_be",
            ),
        ),
    ),
}
