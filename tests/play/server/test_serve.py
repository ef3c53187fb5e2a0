import subprocess
import sys

SERVE = """
import uvicorn
from pathlib import Path
from swarm_pz.kernels.painting import paint
from swarm_pz.play.server.serve import serve
from swarm_pz.policy import load
uvicorn.Server.run = lambda *_, **__: print("compiled:", len(paint.signatures))
serve(load, {}, port=0, folder=Path("games"))
"""


def test_the_first_drawing_waits_for_no_compiler(tmp_path):
    command = [sys.executable, "-c", SERVE]
    printed = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True).stdout  # noqa: S603
    assert printed.splitlines()[-1] == "compiled: 1"
