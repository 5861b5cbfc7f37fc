"""Simulations: the same bits by every way, threads, signals, hands, tools."""

from __future__ import annotations

import contextlib
import gc
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from multiprocessing import get_context

import numpy as np
import pytest

import pliant
from conftest import ROOT, crushed, cube


def test_every_way_gives_the_same_bits(any_solver: pliant.Scene, tmp_path: object) -> None:
    model = any_solver.build()
    steps = min(model.steps, 60)
    one, many = model.simulate(), model.simulate(threads=2)
    for _ in range(steps):
        one.step()
    assert many.step(steps) == steps
    looked = model.simulate()
    for _ in range(steps):
        looked.step()
        looked.sample()
    kept = model.simulate()
    kept.step(steps // 2)
    kept.field("displacement")
    state = pickle.loads(pickle.dumps(kept.state()))
    path = os.path.join(str(tmp_path), "state")
    state.save(path)
    again = pickle.loads(pickle.dumps(model)).simulate()
    again.restore(pliant.State.load(path))
    again.step(steps - steps // 2)
    copy = kept.copy()
    copy.step(steps - steps // 2)
    prints = {sim.fingerprint() for sim in (one, many, looked, again, copy)}
    assert len(prints) == 1, prints


def test_runs_with_files_are_those_of_the_command_line(scene: pliant.Scene, tmp_path: object) -> None:
    scene.output["history"] = {"type": "csv", "every": 0.02}
    files = scene.run(f"{tmp_path}/out")
    memory = scene.run()
    assert files.status == memory.status == "done" and files.steps == memory.steps
    assert np.array_equal(files.reactions["base"], memory.reactions["base"])
    assert np.array_equal(files.history["time"], memory.history["time"])
    assert files.history.units["reaction.base.z"] == "N" == memory.history.units["reaction.base.z"]
    assert files.energies == memory.energies
    with pytest.raises(pliant.OutputError):
        scene.run(f"{tmp_path}/out")
    assert scene.run(f"{tmp_path}/out", force=True).status == "done"


def test_an_interrupted_run_goes_on_from_its_checkpoint(tmp_path: object) -> None:
    # It takes longer than the tenth of a second between two reports.
    scene = cube(12, **{"scene.until": 2.0})
    scene.run_table["checkpoint"] = {"every": 0.1}
    model, out = scene.build(), f"{tmp_path}/out"

    def stop(now: pliant.Progress) -> None:
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        model.run(out, each=stop)
    result = model.run(out, resume=True)
    assert result.status == "done" and result.steps == model.steps
    assert np.array_equal(result.reactions["base"], model.run().reactions["base"])
    with pytest.raises(pliant.ResumeError):
        model.run(f"{tmp_path}/none", resume=True)
    with pytest.raises(ValueError, match="folder"):
        model.run(resume=True)


def test_a_failed_run_keeps_what_was_found() -> None:
    with pytest.warns(pliant.PliantWarning, match="failed"):
        result = crushed().run()
    assert result.status == "failed" and isinstance(result.error, pliant.UnstableError)
    assert len(result.history["time"]) >= 1


def test_steps_end_where_the_run_is_asked_to_end(scene: pliant.Scene) -> None:
    sim = scene.build().simulate()
    history = sim.run(until=0.05, every=0.01, record=["displacement", "velocity"])
    assert history["displacement"].shape == (len(history["time"]), *sim.model.rest.shape)
    assert np.allclose(np.diff(history["time"]), 0.01, atol=sim.step_size)
    assert abs(sim.time - 0.05) <= 0.5 * sim.step_size
    assert history["velocity"][-1, :, 2].min() < 0.0


def test_the_interpreter_is_released() -> None:
    model = cube(8).build()
    sim, stamps, began = model.simulate(), [], threading.Event()

    def look() -> None:
        began.wait()
        for _ in range(20):
            stamps.append(time.monotonic())
            time.sleep(2e-3)

    thread = threading.Thread(target=look)
    thread.start()
    began.set()
    begin = time.monotonic()
    sim.step(2000)
    end = time.monotonic()
    thread.join()
    assert end - begin > 0.02
    assert sum(begin < stamp < end for stamp in stamps) > 3, (begin, end, stamps)


def test_simulations_of_one_model_run_side_by_side(scene: pliant.Scene) -> None:
    model = scene.build()
    alone = model.simulate()
    alone.step(300)
    sims = [model.simulate() for _ in range(3)]
    threads = [threading.Thread(target=sim.step, args=(300,)) for sim in sims]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert {sim.fingerprint() for sim in sims} == {alone.fingerprint()}


def test_a_second_call_is_told_so_at_once() -> None:
    sim = cube(8).build().simulate()
    thread = threading.Thread(target=sim.step, args=(3000,))
    thread.start()
    time.sleep(0.05)
    begin = time.monotonic()
    with pytest.raises(pliant.BusyError):
        sim.step()
    assert time.monotonic() - begin < 0.05
    thread.join()
    assert sim.steps == 3000


def test_ctrl_c_comes_through_and_the_simulation_goes_on() -> None:
    sim = cube(8).build().simulate()
    timer = threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    begin = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        sim.step(10**9)
    assert time.monotonic() - begin < 0.2 + 0.5
    done = sim.steps
    assert done > 0 and sim.step(3) == 3 and sim.steps == done + 3


def test_callbacks_see_all_and_take_no_steps(scene: pliant.Scene) -> None:
    sim, seen = scene.build().simulate(), []

    def look(now: pliant.Simulation) -> None:
        seen.append((now.time, now.energies.kinetic))
        with pytest.raises(pliant.BusyError):
            now.step()
        if len(seen) == 5:
            raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        sim.run(every=0.01, each=look)
    assert len(seen) == 5 and sim.step() == 1


def test_a_fork_is_told() -> None:
    sim = cube().build().simulate()
    if not hasattr(os, "fork"):
        pytest.skip("there are no forks here")
    pid = os.fork()
    if pid == 0:
        code = 1
        try:
            sim.step()
        except pliant.BusyError as error:
            code = 0 if "spawn" in str(error) else 2
        os._exit(code)
    assert os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) == 0
    assert sim.step() == 1


def _stepped(scene: pliant.Scene) -> tuple[int, pliant.State]:
    sim = scene.build().simulate()
    sim.step(30)
    return sim.fingerprint(), sim.state()


def test_scenes_and_states_travel_to_other_processes(scene: pliant.Scene) -> None:
    with get_context("spawn").Pool(1) as pool:
        print_, state = pool.apply(_stepped, (scene,))
    sim = scene.build().simulate()
    sim.step(30)
    assert sim.fingerprint() == print_
    sim.restore(state)
    assert sim.fingerprint() == print_ and np.array_equal(state.displacement, sim.displacement)


def test_numbers_change_from_the_next_step_on(scene: pliant.Scene) -> None:
    sim = scene.build().simulate()
    sim.step(10)
    before = np.array(sim.displacement)
    sim.set({"law.tissue.young-modulus": 20e3})
    assert np.array_equal(sim.displacement, before)
    assert sim.model.scene["law.tissue.young-modulus"] == 20e3
    sim.step(10)
    with pytest.raises(ValueError, match="build a new model"):
        sim.set({"body.cube.mesh": {"block": {"size": [0.1, 0.1, 0.1], "cells": [3, 3, 3]}}})
    with pytest.raises(pliant.SceneError):
        sim.set({"law.tissue.poisson-ratio": 0.7})
    assert sim.step() == 1


def test_pushed_forces_do_work_and_stay(scene: pliant.Scene) -> None:
    scene["scene.gravity"] = (0.0, 0.0, 0.0)
    scene["body.cube.damping"] = 100.0
    model = scene.build()
    sim = model.simulate()
    forces = np.zeros_like(model.rest)
    top = model.select("cube", "z-max")
    forces[top, 2] = 0.1 / len(top)
    sim.push(forces)
    sim.step(3000)
    assert abs(sim.reaction("base")[2] + 0.1) < 1e-3
    assert abs(sim.energies.balance) < 0.01
    state = sim.state()
    sim.restore(state)
    sim.step(10)
    assert abs(sim.reaction("base")[2] + 0.1) < 1e-3
    sim.push(None)
    sim.step(3000)
    assert np.abs(sim.displacement).max() < 1e-6
    sim.push(forces[model.bodies["cube"].nodes], body="cube")


def test_a_hand_pulls_with_the_force_that_the_base_holds(scene: pliant.Scene) -> None:
    scene["scene.gravity"] = (0.0, 0.0, 0.0)
    scene["body.cube.damping"] = 100.0
    sim = scene.build().simulate()
    hand = sim.grip(at=(0.05, 0.05, 0.1), stiffness=50.0)
    hand.place = hand.point + (0.0, 0.0, 0.002)
    sim.step(4000)
    assert hand.force[2] > 1e-3
    assert np.allclose(hand.force, -sim.reaction("base"), atol=1e-5)
    other = sim.grip(nodes=sim.model.select("cube", "x-max"), stiffness=10.0)
    hand.release()
    sim.step()
    with pytest.raises(ValueError, match="released"):
        _ = hand.force
    assert other.stiffness <= 10.0


def test_contacts_and_tools_are_reached_as_in_scenes() -> None:
    sim = pliant.load(ROOT / "scenes/palpation").build().simulate()
    tools = sim.model.tools
    assert tools and sim.model.contacts
    tool = sim.tool(tools[0])
    arrival = sim.drive(tools[0], tool.place + (0.0, 0.0, -0.002), within=0.01)
    assert arrival > sim.time
    sim.step(20)
    assert set(sim.contacts()) == set(sim.model.contacts)
    assert np.isfinite(sim.tool(tools[0]).force).all()
    pose = np.eye(4)
    pose[:3, 3] = tool.place
    sim.drive(tools[0], pose)
    sim.drive(tools[0], (tool.place, (0.0, 0.0, 0.0, 1.0)))


def test_a_thousand_simulations_leave_nothing(scene: pliant.Scene) -> None:
    model = scene.build()

    def pages() -> int:
        with open("/proc/self/statm") as file:
            return int(file.read().split()[1])

    for _ in range(50):
        model.simulate().step()
    gc.collect()
    before, threads = pages(), threading.active_count()
    tasks = len(os.listdir("/proc/self/task"))
    for _ in range(1000):
        model.simulate()
    gc.collect()
    time.sleep(0.2)
    assert (pages() - before) * os.sysconf("SC_PAGESIZE") < 5e6
    assert threading.active_count() == threads and len(os.listdir("/proc/self/task")) <= tasks


def test_shells_fields_and_pictures_are_reached(tmp_path: object) -> None:
    sim = pliant.load(ROOT / "scenes/colon").build().simulate()
    sim.step(2)
    assert sim.field("membrane-force", on="colon").shape[1:] == (3, 3)
    assert sim.field("constraint").shape == (len(sim.model.rest),)
    mesh = sim.mesh(["displacement"])
    assert mesh.point_data["displacement"].shape == mesh.points.shape
    picture = sim.picture(size=(320, 240))
    picture.save(f"{tmp_path}/colon.png")
    pixels = picture.to_numpy()
    assert pixels.shape == (240, 320, 4) and pixels[..., :3].std() > 5
    assert picture._repr_png_()[:8] == b"\x89PNG\r\n\x1a\n"


@pytest.mark.parametrize("solver", ["quasi-static", "static"])
def test_ctrl_c_ends_a_long_load_step_that_is_then_not_taken(solver: str) -> None:
    scene = cube(14, **{"run.solver": solver, "run.load-steps": 1})
    if solver == "static":
        scene["run.linear"] = "direct"
    model = scene.build()
    sim, whole = model.simulate(), model.simulate()
    begin = time.monotonic()
    assert whole.step() == 1
    long = time.monotonic() - begin
    timer = threading.Timer(long / 4, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    begin = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        sim.step()
    assert time.monotonic() - begin < long / 4 + 1.0
    assert (sim.steps, sim.time) == (0, 0.0)
    assert sim.step() == 1
    assert sim.fingerprint() == whole.fingerprint()


def test_a_state_of_another_step_length_goes_on_in_its_own_time(scene: pliant.Scene) -> None:
    sim = scene.build().simulate()
    sim.step(10)
    sim.set({"law.tissue.young-modulus": 40e3})
    sim.step(10)
    time, state = sim.time, sim.state()
    sim.step(10)
    end, wanted = sim.time, sim.fingerprint()
    for kept in (state, pickle.loads(pickle.dumps(state))):
        sim.restore(kept)
        assert sim.time == time
        sim.step(10)
        assert (sim.time, sim.fingerprint()) == (end, wanted)


def test_models_and_simulations_show_themselves(scene: pliant.Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    model = scene.build()
    sim = model.simulate()
    if os.environ.get("PLIANT_REQUIRE_GPU"):
        png = sim._repr_png_()
        assert png is not None and png.startswith(b"\x89PNG") and pliant.Picture(png).size == (960, 720)
        assert "image/png;base64" in model._repr_html_()

    def no_adapter(*_: object, **__: object) -> None:
        raise pliant.DeviceError("there is no adapter")

    monkeypatch.setattr(pliant.Simulation, "picture", no_adapter)
    with pytest.warns(pliant.PliantWarning, match="adapter"):
        assert sim._repr_png_() is None
    with pytest.warns(pliant.PliantWarning, match="adapter"):
        assert "<table>" in model._repr_html_()


def test_the_command_ends_with_its_own_code() -> None:
    command = os.path.join(os.path.dirname(sys.executable), "pliant")
    if not os.path.exists(command):
        pytest.skip("the command is not installed")
    run = lambda *words: subprocess.run([command, *words], capture_output=True).returncode  # noqa: E731
    assert [run("--version"), run("check", "nowhere"), run("no-such-command")] == [0, 2, 2]


def test_threads_that_read_and_step_one_simulation_never_wait_for_each_other_for_ever() -> None:
    sim = cube(4).build().simulate()
    until = time.monotonic() + 1.0
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)

    def again(call: Callable[[], object]) -> None:
        while time.monotonic() < until:
            with contextlib.suppress(pliant.BusyError):
                call()

    calls: list[Callable[[], object]] = [sim.step, lambda: sim.energies, lambda: sim.energies, lambda: sim.steps, lambda: sim.time]
    threads = [threading.Thread(target=again, args=(call,)) for call in calls]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(timeout=30)
    sys.setswitchinterval(interval)
    assert not any(thread.is_alive() for thread in threads) and sim.step() == 1


def test_hands_stay_stable_where_steps_grow_and_where_another_hand_fails(scene: pliant.Scene) -> None:
    sim = scene.replace({"law.tissue.young-modulus": 100e3}).build().simulate()
    hand = sim.grip(at=(0.1, 0.1, 0.1), stiffness=1e9)
    firm = hand.stiffness
    hand.place = hand.point + (0.0, 0.0, 0.002)
    sim.step(20)
    sim.set({"law.tissue.young-modulus": 1e3})
    assert hand.stiffness < firm
    sim.step(200)
    with pytest.raises(ValueError, match="nodes"):
        sim.grip(nodes=[10**6])
    assert np.isfinite(hand.force).all()


def test_a_fork_meshes_anew() -> None:
    def volume() -> int:
        i, j, k = np.mgrid[0:12, 0:12, 0:12]
        ball = ((i - 5.5) ** 2 + (j - 5.5) ** 2 + (k - 5.5) ** 2 < 25).astype(np.uint8)
        image = pliant.Image(ball, np.diag([2e-3, 2e-3, 2e-3, 1.0]))
        return len(pliant.Mesh.of_image(image, 1, edge=5e-3).cells["tetra"])

    count = volume()
    child = os.fork()
    if child == 0:
        os._exit(0 if volume() == count else 1)
    until = time.monotonic() + 30
    while time.monotonic() < until:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            assert os.waitstatus_to_exitcode(status) == 0
            return
        time.sleep(0.02)
    os.kill(child, signal.SIGKILL)
    raise AssertionError("the child hangs")


def test_a_driven_tool_moves_after_a_look_also_where_bodies_touch() -> None:
    scene = pliant.load(ROOT / "scenes/retraction")
    sim = scene.build().simulate()
    name = sim.model.tools[0]
    sim.contacts()
    begin = sim.tool(name).place
    sim.drive(name, begin + (0.0, 0.0, 0.001))
    sim.step(2)
    assert np.allclose(sim.tool(name).place, begin + (0.0, 0.0, 0.001), atol=1e-6)


def grasped() -> pliant.Scene:
    """A flap between the jaws of a grasper, and a ball that touches nothing."""
    scene = pliant.Scene(until=1.0, run={"precision": "double"})
    scene.law["tissue"] = {"type": "neo-hookean", "young-modulus": 5e3, "poisson-ratio": 0.4}
    mesh = {"block": {"size": [0.08, 0.04, 0.01], "cells": [8, 4, 2]}, "as": "hexes"}
    scene.body["flap"] = {"mesh": mesh, "law": "tissue", "density": 1000.0, "damping": 30.0}
    scene.constraint["root"] = {"type": "fix", "body": "flap", "nodes": {"set": "x-min"}}
    jaws = {"jaws": {"length": 0.03, "width": 0.02, "thickness": 0.003}}
    opening = {"angle": 0.8, "curve": {"table": [[0, 1], [1, 1]]}}
    scene.tool["grasper"] = {"shape": jaws, "opening": opening, "at": [0.105, 0.02, 0.005], "turn": [1.2092, -1.2092, -1.2092]}
    scene.tool["ball"] = {"shape": {"sphere": {"radius": 0.01}}, "at": [0.0, 0.0, 0.1]}
    scene.contact["hold"] = {"between": ["all", "grasper"], "friction": 0.5}
    scene.contact["rest"] = {"between": ["flap", "ball"]}
    return scene


def led(*calls: Callable[[pliant.Simulation], object], steps: int = 20) -> tuple[np.ndarray, float]:
    """How far a grasper has come, and its opening."""
    sim = grasped().build().simulate()
    begin = sim.tool("grasper").place
    for call in calls:
        call(sim)
    sim.step(steps)
    end = sim.tool("grasper")
    return end.place - begin, end.opening


def test_a_tool_moves_while_its_jaws_close() -> None:
    goal = np.array([0.105, 0.02, 0.005]) + (0, 0, 0.01)
    step = grasped().build().step

    def drive(sim: pliant.Simulation) -> object:
        return sim.drive("grasper", goal, within=10 * step)

    def close(sim: pliant.Simulation) -> object:
        return sim.open("grasper", 0.3, within=10 * step)

    def both(sim: pliant.Simulation) -> object:
        return sim.drive("grasper", goal, opening=0.3, within=10 * step)

    def one(sim: pliant.Simulation) -> object:
        return sim.step()

    def look(sim: pliant.Simulation) -> object:
        return sim.tool("grasper")

    for calls in ((drive, close), (close, drive), (both,), (drive, one, close), (close, look, drive), (drive, one, look, close)):
        way, opening = led(*calls)
        assert np.allclose(way, (0, 0, 0.01), atol=1e-12) and opening == pytest.approx(0.3, abs=1e-12), calls
    assert led(close) == (pytest.approx([0, 0, 0], abs=1e-15), pytest.approx(0.3))
    way, opening = led(drive)
    assert np.allclose(way, (0, 0, 0.01), atol=1e-12) and opening == pytest.approx(0.8)
    # After a look it begins one step later and arrives when it was asked to: five of nine steps.
    way, opening = led(both, steps=6)
    assert np.allclose(way, (0, 0, 0.01 * 5 / 9), atol=1e-12) and opening == pytest.approx(0.8 - 0.5 * 5 / 9)
    with pytest.raises(ValueError, match="no goal"):
        grasped().build().simulate().drive("grasper")


def test_a_tool_goes_on_its_trajectory_while_its_jaws_are_driven() -> None:
    scene = grasped()
    scene["tool.grasper.by"] = [0, 0, 0.02]
    scene["tool.grasper.curve"] = "ramp"
    alone, closing = scene.build().simulate(), scene.build().simulate()
    closing.open("grasper", 0.3, within=0.01)
    assert alone.step(50) == closing.step(50) == 50
    assert np.array_equal(alone.tool("grasper").place, closing.tool("grasper").place)
    assert closing.tool("grasper").opening == pytest.approx(0.3)


def test_pairs_of_contacts_and_jaws_have_forces_of_their_own() -> None:
    sim = grasped().build().simulate()
    sim.open("grasper", 0.2, within=0.05)
    sim.step(round(0.1 / sim.step_size))
    pairs = {"hold.flap-grasper.upper", "hold.flap-grasper.lower"}
    forces = sim.contacts()
    assert pairs | {"rest"} == {*forces} == {*sim.model.contacts}
    upper, lower, whole = sim.tool("grasper.upper"), sim.tool("grasper.lower"), sim.tool("grasper")
    assert np.array_equal(upper.force, forces["hold.flap-grasper.upper"])
    # Each jaw is pushed open by more than both together move the grasper.
    assert min(np.linalg.norm(upper.force), np.linalg.norm(lower.force)) > 2 * np.linalg.norm(whole.force) > 0
    assert np.allclose(upper.force + lower.force, whole.force, atol=1e-12)
    assert np.linalg.norm(upper.place - whole.place) > 1e-3


def test_runs_in_memory_take_the_steps_of_runs_with_files(any_solver: pliant.Scene, tmp_path: object) -> None:
    for until in (0.05, 0.3):
        memory = any_solver.run(until=until, threads=1)
        files = any_solver.run(f"{tmp_path}/{until}", until=until, threads=1)
        scene = any_solver.replace({"scene.until": until}).run(threads=1)
        assert memory.time == files.time == scene.time and memory.steps == files.steps == scene.steps
        assert np.array_equal(memory.reactions["base"], files.reactions["base"])


@pytest.mark.parametrize("until", [float("nan"), float("inf"), -1.0, 0.0])
def test_runs_without_an_end_are_refused(scene: pliant.Scene, tmp_path: object, until: float) -> None:
    model = scene.build()
    for out in (None, f"{tmp_path}/out"):
        with pytest.raises(ValueError, match="until a time greater than 0"):
            model.run(out, until=until)
    if not np.isfinite(until):
        with pytest.raises(ValueError, match="`until` must be a finite time"):
            model.simulate().run(until=until)


@pytest.mark.parametrize("every", [1e-300, 1e-9, 1e-4])
def test_samples_closer_than_steps_are_one_a_step(scene: pliant.Scene, every: float) -> None:
    sim = scene.build().simulate()
    history = sim.run(until=10 * sim.step_size, every=every)
    assert sim.steps == 10 and len(history["time"]) == 11


def test_callbacks_go_back_to_no_snapshot(scene: pliant.Scene) -> None:
    sim = scene.build().simulate()
    start = sim.state()
    for call in (lambda now: now.restore(start), lambda now: now.reset()):
        with pytest.raises(pliant.BusyError, match="snapshot"):
            sim.run(until=0.05, each=call)
    assert sim.step() == 1


def test_what_ends_a_run_early_has_its_history() -> None:
    sim = crushed().build().simulate()
    with pytest.raises(pliant.UnstableError) as caught:
        sim.run(every=0.005, record="displacement")
    history = caught.value.history
    assert history is not None and history["displacement"].shape == (len(history["time"]), *sim.model.rest.shape)
    assert len(history["time"]) > 3

    def stop(now: pliant.Simulation) -> None:
        if now.steps > 3:
            raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough") as raised:
        cube().build().simulate().run(each=stop)
    assert len(raised.value.history["time"]) > 1  # type: ignore[attr-defined]


@pytest.mark.parametrize("solver", ["static", "implicit"])
def test_equations_that_are_not_solved_tell_residual_and_step(solver: str, tmp_path: object) -> None:
    scene = cube(**{"run.solver": solver, "run.iterations": 1 if solver == "static" else 2, "run.tolerance": 1e-14})
    with pytest.warns(pliant.PliantWarning, match="failed"):
        memory = scene.run()
    with pytest.warns(pliant.PliantWarning, match="failed"):
        files = scene.run(f"{tmp_path}/out")
    for result in (memory, files):
        error = result.error
        assert isinstance(error, pliant.ConvergenceError) and error.load_step is not None and error.residual is not None
        assert 0.0 < error.residual < 1.0 and error.load_step <= 1


def test_selections_by_word_and_by_numpy(scene: pliant.Scene) -> None:
    model = scene.build()
    assert len(model.select("cube", "all")) == 27 and len(model.select("cube", "boundary")) == 26
    assert len(model.select("cube", {"ids": np.array([1, 2])})) == 2
    assert len(model.select("cube", {"sphere": {"centre": np.zeros(3), "radius": np.float64(0.06)}})) == 4
    with pytest.raises(TypeError):
        model.simulate().step(2.7)  # type: ignore[arg-type]
    assert model.simulate().step(np.int64(3)) == 3
