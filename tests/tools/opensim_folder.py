"""Every OpenSim model of a folder through the generator, beside OpenSim: `make opensim MODELS=folder`.

Prints for each file its joints and links, and the errors of the torques and of each link's share at a random
motion, as parts of the largest torque, or the reason for refusing it. Where they differ, linkwise is held
against the Lagrangian of OpenSim's own energies: Simbody's velocity terms are off where the second and third
rotation of a joint follow one coordinate. Exits with 1 where an error is above LIMIT.
"""

import argparse
import sys
import tempfile
from pathlib import Path

from linkwise import LinkwiseError

sys.path.insert(0, str(Path(__file__).parents[1]))

from numeric.opensim_beside import Beside

LIMIT = 1e-6


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("folder", type=Path)
    files = sorted(parser.parse_args().folder.rglob("*.osim"))
    bad = refused = 0
    for number, file in enumerate(files):
        with tempfile.TemporaryDirectory() as folder:
            try:
                both = Beside(file, Path(folder) / f"model{number}")
                errors = both.errors()
            except LinkwiseError as error:
                refused += 1
                print(f"refused  {error}")
                continue
            except RuntimeError as error:  # OpenSim's own
                refused += 1
                print(f"OpenSim  {file}: {str(error).splitlines()[0]}")
                continue
        told = f"torques {errors[0]:.1e}, shares {errors[1]:.1e}"
        wrong = max(errors) > LIMIT
        if wrong and (by_energies := both.error_of_energies()) <= LIMIT:
            wrong, told = False, f"{told}, but by OpenSim's own energies {by_energies:.1e}"
        bad += wrong
        size = f"{len(both.names)} joints, {len(both.robot.link_names)} links"
        print(f"{'WRONG' if wrong else 'ok':8} {file}: {size}; {told}")
    print(f"{len(files)} models, {refused} refused, {bad} wrong")
    return 1 if bad or not files else 0


if __name__ == "__main__":
    sys.exit(main())
