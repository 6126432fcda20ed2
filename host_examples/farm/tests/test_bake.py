"""Claims about baking on Dask, with real worker processes: killed, resumed and damaged, the outputs are the undisturbed ones."""

import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

import numpy
import psutil
import shellwarp
import small
from pxr import Usd, UsdGeom

from shellwarp_farm import bake as baking
from shellwarp_farm import manifest
from shellwarp_farm.engine import Engine
from shellwarp_farm.errors import SceneError
from shellwarp_farm.job import RECORDS, state_of
from shellwarp_farm.job_log import JobLog
from shellwarp_farm.model import load_model, model_key, model_tables

LONG = small.LIST.replace("steps_per_frame = 2", "steps_per_frame = 1500").replace("seeds = [1, 2]", "seeds = [1, 2, 3]")
# Steps that the explicit shell bears.
METHODS = """
formats = ["pc2"]
[[asset]]
name = "card"
mesh = "card.obj"
material = { k_area = 50, k_length = 50, k_bend = 2.7e-3, density = 0.3 }
support = [{ kind = "fixed", vertices = [0, 1, 2, 3, 4, 5] }]
simulation = { modes = 6, reduced_fields = 4 }
damping = { ratio = 0.05 }
[parameters]
"simulation.method" = NAMES
[[shot]]
name = "fall"
frames = [0, 3]
simulation = { gravity = [0, 0, -1], frame_rate = 1e4, steps_per_frame = 4 }
"""
PATIENCE = 3600   # seconds until a test that waits for another process counts as hung


def positions(path):
    """A PC2 file: (frames x n x 3)."""
    data = Path(path).read_bytes()
    n, frames = numpy.frombuffer(data, "<i4", 1, 16)[0], numpy.frombuffer(data, "<i4", 1, 28)[0]
    return numpy.frombuffer(data, "<f4", offset=32).reshape(frames, n, 3)


def motion_of(model, job, saved):
    """What a saved state has of the motion: Newton steps of what was written are forgotten."""
    with state_of(job, model) as state:
        state.load(saved)
        state.correct(0)
        return state.save()


def wait_for(condition):
    end = time.monotonic() + PATIENCE
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError("it did not come to that")
        time.sleep(0.01)


def gone(pid):
    """Whether a process has ended, were it unreaped."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] == "Z"
    except OSError:
        return True


def fails_twice(path):
    """A task that finds no room for its files until the third try."""
    with open(path, "a", encoding="ascii") as file:
        file.write("x")
    if len(Path(path).read_text()) < 3:
        raise OSError("no space left")
    return "done"


class Farm(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.top = Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        cls.engine = cls.enterClassContext(Engine(workers=2))
        cls.jobs = small.jobs(cls.top, LONG)
        cls.undisturbed = cls.top / "undisturbed"
        cls.report = baking.bake(cls.engine, cls.jobs, cls.undisturbed)

    def bake(self, folder, jobs=None, **options):
        return baking.bake(self.engine, jobs or self.jobs, self.top / folder, **options)

    def assert_undisturbed(self, folder):
        self.assertEqual(baking.verify(self.top / folder, self.undisturbed), [])

    def test_each_model_is_made_once_and_each_job_has_its_outputs(self):
        self.assertEqual((self.report["jobs"], self.report["baked"], self.report["failed"]), (12, 12, []))
        self.assertEqual((self.report["models"], self.report["made"]), (2, 2))
        self.assertEqual(len(manifest.outputs(manifest.read(self.undisturbed))), 36)
        self.assertGreater(len({record["worker"] for record in manifest.read(self.undisturbed)}), 1)

    def test_the_worst_frame_and_the_last_are_certified_in_record_log_and_report(self):
        worst = max(record["certified"]["worst"]["error"] for record in manifest.read(self.undisturbed))
        self.assertGreater(worst, 1e-5, "six modes are not the full shell, which gets 0")
        self.assertEqual(self.report["certified"], {record["job"]: record["certified"] for record in manifest.read(self.undisturbed)})
        self.assertIn(f"at most {100 * worst:.2g} % off the full shell, card/", baking.certified(self.report["certified"]))
        for record in manifest.read(self.undisturbed):
            log = (self.undisturbed / "logs" / f"{record['job']}.log").read_text()
            facts = record["certified"]
            self.assertIn(f"frame {facts['worst']['frame']}: {100 * facts['worst']['error']:.2g} % of the largest displacement off", log)
            self.assertIn(f"last frame: {100 * facts['error']:.2g} %", log)
        report = self.bake("uncertified", small.jobs(self.top, "certify = false\n" + small.LIST))
        self.assertEqual(baking.certified(report["certified"]), "not certified: nobody asks for it")

    def test_correction_steps_change_what_is_written_and_not_the_motion(self):
        """From the warp's last frame the fifth step moves less than a hundredth of what the first did."""
        text = small.LIST.replace("[parameters]", '[parameters]\n"simulation.correction_steps" = [0, 1, 5, 6]').replace("seeds = [1, 2]", "seeds = [1]").replace("[0, 0, -1]", "[0, 0, -30]")
        jobs = small.jobs(self.top, text)
        self.assertEqual(self.bake("corrected", jobs)["failed"], [])
        frames, states = {}, {}
        for job in jobs:
            if job["shot"] == "one" and job["material"]["k_bend"] == 2.7e-3:
                base = self.top / "corrected" / job["name"]
                frames[job["simulation"]["correction_steps"]] = positions(f"{base}.pc2")
                states[job["simulation"]["correction_steps"]] = Path(f"{base}.state").read_bytes()
        model = load_model(model_tables(jobs[0]), model_key(model_tables(jobs[0])), self.top / "corrected" / "cache")[0]
        self.assertEqual(len({motion_of(model, jobs[0], saved) for saved in states.values()}), 1)
        first, last = numpy.abs(frames[1] - frames[0]).max(), numpy.abs(frames[6] - frames[5]).max()
        self.assertGreater(first, 1e-6)
        self.assertLess(last, 0.01 * first)

    def test_correction_steps_go_on_from_shot_to_shot_and_the_record_says_what_they_leave(self):
        """From the warp's frames one step a frame leaves less than half."""
        heavy = small.LIST.replace("[parameters]", '[parameters]\n"simulation.correction_steps" = [0, 1]').replace("[0, 0, -1]", "[0, 0, -30]")
        both = "[[shot]]" + heavy.split("[[shot]]")[1].replace('"one"', '"both"').replace("[0, 5]", "[0, 11]")
        jobs = [job for job in small.jobs(self.top, heavy + both) if job["seed"] == 1 and job["material"]["k_bend"] == 2.7e-3]
        self.assertEqual(self.bake("led", jobs)["failed"], [])
        records = {record["job"]: record for record in manifest.read(self.top / "led")}
        base = {(job["shot"], job["simulation"]["correction_steps"]): self.top / "led" / job["name"] for job in jobs}
        frames = {key: positions(f"{path}.pc2") for key, path in base.items()}
        for steps in (0, 1):
            self.assertTrue(numpy.array_equal(numpy.concatenate([frames["one", steps], frames["two", steps]]), frames["both", steps]))
            self.assertEqual(Path(f"{base['two', steps]}.state").read_bytes(), Path(f"{base['both', steps]}.state").read_bytes())
        self.assertGreater(numpy.abs(frames["both", 1] - frames["both", 0])[-1].max(), 1e-6)
        for job in jobs:
            facts, steps = records[job["name"]]["certified"], job["simulation"]["correction_steps"]
            self.assertEqual(["corrected_error" in part for part in (facts, facts["worst"])], [steps > 0] * 2)
            if steps:
                self.assertLess(facts["corrected_error"], 0.5 * facts["error"])
            words = (self.top / "led" / "logs" / f"{job['name']}.log").read_text()
            self.assertEqual(steps > 0, "% as written" in words)

    def test_every_method_of_the_library_bakes_or_is_told_and_an_unknown_one_too(self):
        folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        with self.assertRaisesRegex(SceneError, "'magic', expected one of 'warp', "):
            self.bake("magic", small.jobs(folder, METHODS.replace("NAMES", '["magic"]')))
        report = self.bake("methods", small.jobs(folder, METHODS.replace("NAMES", json.dumps(list(shellwarp.methods())))))
        self.assertGreaterEqual(report["baked"], 8)
        self.assertEqual(report["models"], 3, "those by modes and the full shells share one; fields and the choice have their own")
        failed = {name for name in shellwarp.methods() if any(f"method={name}: " in line for line in report["failed"])}
        self.assertEqual(len(failed), len(report["failed"]), "what a model lacks is told")
        for name in set(shellwarp.methods()) - failed:
            frames = positions(self.top / "methods" / "card" / "fall" / f"card_fall_method={name}.pc2")
            self.assertLess(frames[-1, :, 2].min(), -1e-8, name)   # half of g t^2, 4.5e-8

    def test_a_worker_killed_in_the_middle_changes_nothing(self):
        killed = []

        def kill(_result):
            if not killed:
                killed.append(next(iter(self.engine.client.run(os.getpid).values())))
                os.kill(killed[0], signal.SIGKILL)

        report = self.bake("worker", on_result=kill)
        self.assertTrue(gone(killed[0]))
        self.assertEqual(report["failed"], [])
        self.assertEqual(report["digest"], self.report["digest"])
        # The job that was under way says nothing more; one that had just ended goes with the memory of its worker.
        self.assertTrue(all(line.endswith(("ended without a word: killed, or out of memory", "done, and its result was lost"))
                            for line in report["tried_again"]), report["tried_again"])
        self.assert_undisturbed("worker")

    def test_a_run_killed_in_the_middle_goes_on_where_it_was(self):
        out = self.top / "run"
        command = [sys.executable, "-m", "shellwarp_farm", "bake", str(self.top / "list.toml"), "--out", str(out), "--workers", "1"]
        process = subprocess.Popen(command + ["--quiet"], stdout=subprocess.DEVNULL)
        wait_for(lambda: len(list((out / RECORDS).rglob("*.json"))) >= 3)
        children = psutil.Process(process.pid).children(recursive=True)
        self.assertTrue(children)
        process.kill()
        process.wait()
        wait_for(lambda: all(gone(child.pid) for child in children))   # its workers end with it
        self.assertFalse((out / manifest.NAME).exists())
        finished = len([path for path in (out / RECORDS).rglob("*.json") if ".partial" not in path.name])
        self.assertLess(finished, len(self.jobs), "it was done before it was killed: the test has shown nothing")
        report = self.bake("run")
        self.assertEqual((report["verified"], report["baked"]), (finished, len(self.jobs) - finished))
        self.assert_undisturbed("run")

    def test_damaged_and_missing_outputs_are_baked_again_and_told(self):
        few = self.jobs[:4]
        self.bake("damaged", few)
        paths = sorted((self.top / "damaged").rglob("*.pc2"))
        data = bytearray(paths[0].read_bytes())
        data[100] ^= 1
        paths[0].write_bytes(data)
        paths[1].unlink()
        report = self.bake("damaged", few)
        self.assertEqual((report["verified"], report["baked"], report["made"]), (2, 2, 0))
        self.assertEqual(sorted(line.split(" is ")[-1] for line in report["redone"]), ["damaged", "missing"])
        self.assertEqual(baking.verify(self.top / "damaged"), [])

    def test_a_damaged_cache_entry_is_rebuilt_and_told_and_the_outputs_stay_the_same(self):
        cache = self.top / "cache"
        self.bake("before", self.jobs[:1], cache=cache)
        entry = next(cache.rglob("*.model"))
        data = bytearray(entry.read_bytes())
        data[-20] ^= 1
        entry.write_bytes(data)
        report = self.bake("after", self.jobs[:1], cache=cache)
        self.assertEqual((report["made"], len(report["damage"])), (1, 1))
        self.assertIn(entry.name, report["damage"][0])
        for path in (self.top / "after").rglob("*.pc2"):
            self.assertEqual(path.read_bytes(), (self.undisturbed / path.relative_to(self.top / "after")).read_bytes())

    def test_a_shot_continued_has_the_bits_of_one_long_shot(self):
        text = re.sub(r"steps_per_frame = 1500", "steps_per_frame = 2", LONG)
        long = text.split("[[shot]]")
        joined = "[[shot]]".join(long[:2]).replace("frames = [0, 5]", "frames = [0, 11]")
        folder = self.top / "joined_list"
        folder.mkdir()
        whole, halves = small.jobs(folder, joined), small.jobs(folder, text)
        self.bake("joined", whole[:1])
        self.bake("halves", [job for job in halves if (job["seed"], job["parameters"]) == (1, whole[0]["parameters"])])
        first, second = (next((self.top / "halves" / "card" / shot).glob("*.pc2")) for shot in ("one", "two"))
        joined = positions(next((self.top / "joined").rglob("*.pc2")))
        self.assertTrue(numpy.array_equal(numpy.concatenate([positions(first), positions(second)]), joined))
        self.assertGreater(numpy.abs(joined[-1] - joined[0]).max(), 1e-4)   # it moves

    def test_usd_has_the_positions_of_pc2_and_seeds_differ(self):
        one, two = sorted((self.undisturbed / "card/two").glob("*k_bend=0.005_s[12].pc2"))
        frames = positions(one)
        stage = Usd.Stage.Open(str(one.with_suffix(".usdc")))
        mesh = UsdGeom.Mesh(stage.GetDefaultPrim())
        self.assertEqual(mesh.GetPointsAttr().GetTimeSamples(), list(range(6, 12)))
        for k, points in enumerate(frames):
            self.assertTrue(numpy.array_equal(numpy.array(mesh.GetPointsAttr().Get(6 + k)), points))
        self.assertFalse(numpy.array_equal(frames, positions(two)))

    def test_a_job_that_cannot_be_done_fails_by_name_and_the_others_go_on(self):
        bad = {**self.jobs[0], "mesh": str(self.top / "nowhere.obj"), "name": "card/one/bad"}
        after = {**self.jobs[6], "after": bad["name"], "name": "card/two/after_bad"}
        report = self.bake("failing", [bad, self.jobs[1], after])
        self.assertEqual(report["baked"], 1)
        self.assertEqual(len(report["failed"]), 2)
        for line in report["failed"]:
            self.assertIn("nowhere.obj: there is no such mesh", line)

    def test_what_fails_for_want_of_room_is_tried_again(self):
        self.assertEqual(self.engine.submit(fails_twice, str(self.top / "tries"), key="flaky").result(PATIENCE), "done")

    def test_a_job_that_goes_on_failing_is_reported_and_the_others_go_on(self):
        blocked = {**self.jobs[0], "name": "card/file/blocked"}
        (self.top / "blocked" / "card").mkdir(parents=True)
        (self.top / "blocked" / "card" / "file").write_text("where a folder should be")
        report = self.bake("blocked", [blocked, self.jobs[1]])
        self.assertEqual((report["baked"], len(report["failed"])), (1, 1))
        self.assertIn("card/file/blocked", report["failed"][0])

    def test_the_log_of_a_job_says_why_it_was_tried_again(self):
        blocked = {**self.jobs[0], "name": "card/log/blocked"}
        out = self.top / "told"
        (out / "card").mkdir(parents=True)
        (out / "card" / "log").write_text("where a folder should be")
        report = self.bake("told", [blocked, self.jobs[1]])
        self.assertIn("logs/card/log/blocked.log", report["failed"][0])
        self.assertEqual(len(report["tried_again"]), 2, "as often as --retries says")
        text = (out / "logs" / "card" / "log" / "blocked.log").read_text()
        for words in ("try 1 begins", "try 1 failed: FileExistsError", "again: FileExistsError", "try 3 begins", "Traceback"):
            self.assertIn(words, text)
        done = (out / "logs" / f"{self.jobs[1]['name']}.log").read_text()
        for words in ("try 1 begins", "baking: not done before", "model ", "39 vertices, warp", "baked in ", "3 files", "try 1 ends"):
            self.assertIn(words, done)
        self.assertNotIn("failed", done)

    def test_a_try_whose_worker_died_is_told_apart_from_one_that_raised(self):
        first = JobLog(self.top / "silent", "card/one/x", "run")   # and says no more
        self.assertEqual((first.number, first.reasons), (1, []))
        second = JobLog(self.top / "silent", "card/one/x", "run")
        second.fail(OSError("no space left"))
        third = JobLog(self.top / "silent", "card/one/x", "run")
        third.end("baked")
        self.assertEqual(third.number, 3)
        self.assertRegex(third.reasons[0], r"^\S+:\d+ ended without a word")
        self.assertEqual(third.reasons[1], "OSError: no space left")
        self.assertEqual(JobLog(self.top / "silent", "card/one/x", "another run").number, 1)

    def test_what_a_job_does_beyond_the_range_of_its_method_is_in_its_log(self):
        folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        text = small.LIST.replace("gravity = [0, 0, -1]", "gravity = [0, 0, -4000]").replace("seeds = [1, 2]\n", "seeds = [1]\n")
        job = small.jobs(folder, text)[0]
        report = self.bake("far", [job])
        said = (self.top / "far" / "logs" / f"{job['name']}.log").read_text()
        self.assertIn(job["name"], report["turned_too_far"])
        self.assertIn(f"frame {report['turned_too_far'][job['name']]['first_out']}: turned too far", said)

    def test_a_running_scheduler_is_used_by_its_address(self):
        command = [sys.executable, "-m", "shellwarp_farm", "bake", str(self.top / "list.toml"), "--out", str(self.top / "remote"),
                   "--scheduler", self.engine.client.scheduler.address, "--quiet"]
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn(self.report["digest"], done.stdout)
        mine = set(map(str, self.engine.client.run(os.getpid).values()))
        self.assertLessEqual({record["worker"].split(":")[1] for record in manifest.read(self.top / "remote")}, mine)


if __name__ == "__main__":
    unittest.main()
