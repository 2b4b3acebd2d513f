"""The wheel has arm_report/arm, which is generated from arm.urdf while it is built."""

from pathlib import Path

from linkwise import generate, read_system, write_package
from setuptools import setup
from setuptools.command.build_py import build_py

ROBOT = "arm.urdf"


class BuildWithRobot(build_py):
    """Python files, and among them the robot's package; in an editable install it lies beside the sources."""

    def run(self) -> None:
        """Copy what is there, then generate."""
        super().run()
        files = generate(read_system(ROBOT), ["numpy"], vendor_runtime=True)
        write_package(files, self._package(), replace=True)

    def get_source_files(self) -> list[str]:
        """Return what goes into the archive of sources: the robot's file too."""
        return [*super().get_source_files(), ROBOT]

    def _package(self) -> Path:
        root = self.get_package_dir("arm_report") if self.editable_mode else f"{self.build_lib}/arm_report"
        return Path(root, "arm")


setup(cmdclass={"build_py": BuildWithRobot})
