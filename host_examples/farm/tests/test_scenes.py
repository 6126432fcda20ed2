"""Claims about scene lists: what they expand to, and what is refused."""

import tempfile
import unittest

import small

from shellwarp_farm.errors import SceneError


class Expansion(unittest.TestCase):
    def jobs(self, text=small.LIST):
        with tempfile.TemporaryDirectory() as folder:
            return small.jobs(folder, text)

    def test_a_list_is_the_product_of_its_assets_shots_seeds_and_parameters(self):
        jobs = self.jobs()
        self.assertEqual(len(jobs), 1 * 2 * 2 * 2)
        self.assertEqual({(j["shot"], j["seed"], j["material"]["k_bend"]) for j in jobs},
                         {(shot, seed, bend) for shot in ("one", "two") for seed in (1, 2) for bend in (2.7e-3, 5e-3)})
        self.assertEqual(jobs[0]["name"], "card/one/card_one_k_bend=0.0027_s1")

    def test_a_job_comes_after_the_one_that_it_continues_with_equal_seed_and_parameters(self):
        jobs = self.jobs()
        names = [job["name"] for job in jobs]
        for job in jobs[4:]:
            before = jobs[names.index(job["after"])]
            self.assertLess(names.index(job["after"]), names.index(job["name"]))
            self.assertEqual((before["seed"], before["parameters"]), (job["seed"], job["parameters"]))

    def test_the_shots_tables_go_over_the_assets_and_parameters_over_both(self):
        text = small.LIST.replace("[parameters]", '[parameters]\n"damping.ratio" = [0.3]')
        job = self.jobs(text.replace("wind =", "damping = { ratio = 0.1, mass = 2 }\nwind =", 1))[0]
        self.assertEqual(job["damping"], {"ratio": 0.3, "mass": 2})
        self.assertEqual(job["simulation"]["modes"], 6)

    def test_a_shot_without_gusts_is_baked_once_whatever_the_seeds(self):
        text = small.LIST + '[[shot]]\nname = "still"\nframes = [0, 1]\n'
        self.assertEqual([j["seed"] for j in self.jobs(text) if j["shot"] == "still"], [None, None])

    def test_mistakes_are_refused_with_their_place(self):
        for old, new, message in [
            ("damping = {", "dampening = {", "asset card: unknown key 'dampening'"),
            ("ratio", "rate", "asset card, damping: unknown key 'rate'"),
            ('name = "two"', 'name = "one"', "two shots have the name one"),
            ("[6, 11]", "[7, 11]", "begins at frame 7, but one ends at 5"),
            ('after = "one"', 'after = "three"', "no shot before it"),
            ('"material.k_bend"', '"material.k_fold"', "is no \"table.key\""),
            ("seeds = [1, 2]", "seeds = [1, 1]", "one comes twice"),
            ("gust = 0.5", "density = 1", "seeds change nothing"),
            ('name = "card"', 'name = "../card"', "part of a file name"),
            ("seeds", "seeds = = 3", "line 2"),
            ("damping = {", 'collider = [{ kind = "ball" }]\ndamping = {', "asset card, collider 1: the kind is 'ball'"),
            ("damping = {", 'collider = [{ kind = "plane" }, { kind = "sphere" }]\ndamping = {', "collider 2: a sphere needs radius"),
            ("damping = {", 'collider = [{ kind = "plane", radius = 1 }]\ndamping = {', "collider 1: a plane has no radius"),
            ("damping = {", 'collider = [{ kind = "plane", position = [0, 1] }]\ndamping = {', "position is .0, 1., expected three"),
            ("damping = {", 'collider = [{ kind = "plane", key = [{ time = 1 }, { time = 1 }] }]\ndamping = {', "times must ascend"),
            ("damping = {", 'collider = [{ kind = "plane", size = 1 }]\ndamping = {', "unknown key 'size'"),
            ("[parameters]", '[parameters]\n"simulation.correction_steps" = [101]', "correction_steps is 101, expected a whole number from 0 to 100"),
            ("[parameters]", '[parameters]\n"simulation.correction_steps" = [true]', "correction_steps is True"),
        ]:
            with self.subTest(new), self.assertRaisesRegex(SceneError, message):
                self.jobs(small.LIST.replace(old, new))

    def test_equal_labels_are_refused_rather_than_written_over_each_other(self):
        with self.assertRaisesRegex(SceneError, "two jobs have the name"):
            self.jobs(small.LIST.replace("[2.7e-3, 5e-3]", "[1, 1.00000001]"))


if __name__ == "__main__":
    unittest.main()
