"""The verb `run`: the supervisor alone, without a launcher."""

from __future__ import annotations

import sys
from functools import partial

import typer

from foosim.cli.run_command import with_options
from foosim.launcher.run_options import RunOptions
from foosim.runtime.command import NewRunOption, new_app
from foosim.runtime.health import ProgressOption

app = new_app()


@app.command()
@with_options()
def run_supervisor(
    options: RunOptions,
    run: NewRunOption = None,
    progress_file: ProgressOption = None,
) -> None:
    """Run a supervisor only.

    The vHub, nodes and players are started separately. The run's folder has the run file, logs and journals.
    """
    from foosim.launcher.plan import make_plan
    from foosim.launcher.resume import supervisor_records
    from foosim.runtime.process import has_launcher
    from foosim.runtime.run_folder import create_run, open_run, run_exists, runs_folder
    from foosim.supervisor.main import serve

    plan = make_plan(options)
    is_launched = has_launcher()
    if not is_launched:  # a launcher has checked, and watches the disks
        from foosim.launcher.begin import check_room

        for warning in check_room(plan, None, runs_folder()):
            print(warning, file=sys.stderr)
    folder = open_run(run) if run is not None and run_exists(run) else create_run(plan.deployment.world, run)
    settings = plan.settings(folder.name, is_launched=is_launched)
    records = partial(supervisor_records, folder, plan.options)
    raise typer.Exit(serve(settings, plan.address, plan.options.pki, folder, records, progress_file))
