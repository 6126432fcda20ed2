// SOP_ShellWarp, loaded and cooked as Houdini would, in the stand-in of tests/hosts/houdini. Arguments: the plug-in,
// docs/guide/houdini.md. A third argument is a folder: the first scene of docs/guide/houdini.md is written there as OBJ files, for its picture.
#include "concave_sheet.hpp"
#include "fake_houdini.hpp"
#include "test_support.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <vector>

namespace {

using Points = std::vector<UT_Vector3>;

constexpr int kTip = (STRIP_COLUMNS - 1) * STRIP_ROWS + 1;
const fake::Plugin *plugin = nullptr;

bool contains(const std::string &text, const char *part) { return text.find(part) != std::string::npos; }

// What is not a number is the same as itself here.
bool same(float a, float b) { return a == b || (std::isnan(a) && std::isnan(b)); }
bool same(const Points &a, const Points &b) {
  return a.size() == b.size() &&
         std::equal(a.begin(), a.end(), b.begin(), [](const UT_Vector3 &p, const UT_Vector3 &q) {
           return same(p.x(), q.x()) && same(p.y(), q.y()) && same(p.z(), q.z());
         });
}

void add_polygon(fake::Geometry &geometry, std::vector<GA_Index> points) {
  geometry.primitives.emplace_back();
  geometry.primitives.back().points = std::move(points);
}

// The strip of the C tests, lying in the plane of x and z, its first column in the group "held".
GU_Detail strip_detail() {
  const Strip strip = make_strip();
  GU_Detail detail;
  fake::Geometry &geometry = detail.fake_geometry();
  for (int i = 0; i < STRIP_VERTICES; ++i)
    geometry.points.emplace_back(float(strip.positions[3 * i]), 0.0f, float(-strip.positions[3 * i + 1]));
  for (int t = 0; t < STRIP_TRIANGLES; ++t)
    add_polygon(geometry, {strip.triangles[3 * t], strip.triangles[3 * t + 1], strip.triangles[3 * t + 2]});
  geometry.group("held", {0, 1, 2});
  return detail;
}

struct Scene {
  std::unique_ptr<SOP_Node> node = plugin->create();
  GU_Detail mesh = strip_detail(), handles, solid;
  fake::Cook &cook = node->fake_cook();

  Scene() {
    fake::interrupts() = {};
    cook.inputs[0] = &mesh;
    cook.set_text("supportgroup", "held");
    cook.set_text("method", "warp");
    cook.set("modes", {6});
  }
  fake::Geometry &geometry() { return mesh.fake_geometry(); }
  const Points &at(double frame) {
    OP_Context context((frame - 1) / cook.frames_per_second);
    node->fake_run(context);
    return cook.output.fake_geometry().points;
  }
  Points play(int last) {
    for (int frame = 1; frame < last; ++frame) at(frame);
    return at(last);
  }
  // A second input with one point.
  void lead(double vertex, const UT_Vector3 &target) {
    fake::Geometry &points = handles.fake_geometry();
    points.points = {target};
    points.attributes["shellpoint"] = {vertex};
    cook.inputs[1] = &handles;
  }
  // A third input: a box across the strip's free end, its top at a height.
  void put_box(float top) {
    fake::Geometry &box = solid.fake_geometry();
    box = {};
    for (int i = 0; i < 8; ++i)
      box.points.emplace_back(i & 1 ? 4.5f : 2.9f, i & 2 ? top : top - 1, i & 4 ? 1.0f : -1.0f);
    for (const std::vector<GA_Index> &face : std::vector<std::vector<GA_Index>>{
             {0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}})  // clockwise, seen from outside
      add_polygon(box, face);
    cook.inputs[2] = &solid;
  }
  double tip() { return cook.output.fake_geometry().points[kTip].y(); }
};

// ---------------------------------------------------------------------------------------------------------------- time

void the_operator_takes_a_mesh_and_perhaps_handles() {
  CHECK(plugin->op().name == "shellwarp" && plugin->op().min_sources == 1 && plugin->op().max_sources == 4);
  CHECK(std::string(plugin->create()->inputLabel(1)) == "Points that hold or lead them");
  CHECK(std::string(plugin->create()->inputLabel(2)) == "Polygons that they touch");
  CHECK(std::string(plugin->create()->inputLabel(3)) == "Polygons to simulate in their place");
}

void the_documentation_names_every_parameter(const char *page) {
  std::ifstream file(page);
  const std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  const std::unique_ptr<SOP_Node> node = plugin->create();
  for (const auto &[name, parm] : node->fake_cook().parms) {
    CHECK(contains(text, ("| `" + name + "` |").c_str()));
    if (!contains(text, ("| `" + name + "` |").c_str()))
      printf("   %s (%s) is not in %s\n", name.c_str(), parm.type.c_str(), page);
  }
}

void the_start_frame_shows_the_mesh_as_it_came_in() {
  Scene scene;
  CHECK(same(scene.at(1), scene.geometry().points) && same(scene.at(-30), scene.geometry().points));
  CHECK(scene.cook.errors.empty() && scene.cook.warnings.empty());
}

void playing_moves_P_alone_and_says_so() {
  Scene scene;
  const Points points = scene.play(30);
  CHECK(scene.tip() < -0.05 && scene.cook.errors.empty());
  for (int i = 0; i < 2 * STRIP_ROWS; ++i) CHECK(points[std::size_t(i)].y() == 0);
  CHECK(scene.cook.output.getP()->bumps == 1);
  CHECK(scene.cook.output.fake_geometry().primitives.size() == scene.geometry().primitives.size());
}

void scrubbing_repeats_playing_bit_for_bit() {
  Scene scene;
  std::vector<Points> frames;
  for (int frame = 1; frame <= 30; ++frame) frames.push_back(scene.at(frame));
  std::mt19937 random(1);
  for (int k = 0; k < 60; ++k) {
    const std::size_t frame = random() % 30;
    CHECK(same(scene.at(double(frame) + 1), frames[frame]));
  }
}

void motion_blur_samples_do_not_disturb_the_frames() {
  Scene plain, blurred;
  for (int frame = 1; frame <= 20; ++frame) {
    for (const double shutter : {-0.25, 0.25}) blurred.at(frame + shutter);
    CHECK(same(blurred.at(frame), plain.at(frame)));
  }
}

// Houdini may keep a node's cache, or not: the shell goes on where it was, also while something moves.
void a_dropped_cache_changes_nothing() {
  Scene kept, dropped;
  dropped.cook.keep_cache = false;
  for (int frame = 1; frame <= 12; ++frame) {
    for (Scene *scene : {&kept, &dropped}) scene->cook.set("framet", {0, 0, 0.01 * frame * frame});
    CHECK(same(dropped.at(frame), kept.at(frame)));
  }
  CHECK(dropped.cook.warnings.empty() && dropped.cook.errors.empty());
}

// A compiled loop over three pieces with one cache, or with none kept: each piece is what a node of its own gives.
void pieces_of_a_compiled_loop_keep_apart() {
  for (const bool keep : {true, false}) {
    std::vector<std::unique_ptr<Scene>> alone;
    std::vector<GU_Detail> pieces;
    for (int k = 0; k < 3; ++k) {
      alone.push_back(std::make_unique<Scene>());
      for (UT_Vector3 &p : alone.back()->geometry().points)
        p = UT_Vector3(p.x(), p.y(), p.z() * (1.1f + 0.2f * float(k)));
      pieces.push_back(alone.back()->mesh);
    }
    Scene loop;
    loop.cook.compiled = true;
    loop.cook.keep_cache = keep;
    for (int frame = 1; frame <= 8; ++frame)
      for (std::size_t k = 0; k < 3; ++k) {
        loop.cook.inputs[0] = &pieces[k];
        for (Scene *scene : {&loop, alone[k].get()}) scene->cook.set("framet", {0, 0.01 * frame * frame, 0});
        CHECK(same(loop.at(frame), alone[k]->at(frame)));
        CHECK(loop.cook.warnings.empty() && loop.cook.errors.empty());
      }
  }
}

void a_jumped_frame_is_marked_as_not_simulated() {
  Scene scene;
  scene.at(1);
  scene.cook.set("framet", {0, 0, 1});
  scene.at(9);
  CHECK(scene.cook.warnings.size() == 1 && contains(scene.cook.warnings[0], "not simulated: frames were skipped"));
}

// A frame is some hundred bytes; a model of 123 points and 6 modes is above 24 bytes for each.
void the_cache_tells_its_memory() {
  Scene scene;
  scene.at(1);
  const int64 at_start = scene.cook.cache->getMemoryUsage(false);
  scene.play(40);
  const int64 later = scene.cook.cache->getMemoryUsage(false);
  CHECK(at_start > STRIP_VERTICES * 6 * 24 && later > at_start + 39 * 200 && later < at_start + 39 * 4000);
  CHECK(scene.cook.cache->getMemoryUsage(true) > later);
}

// ---------------------------------------------------------------------------------------------------------- parameters

// The menu is the library's table, and what a scene keeps is the method's name: it survives a table that grows.
void the_menu_of_methods_is_the_librarys_table() {
  const std::unique_ptr<SOP_Node> node = plugin->create();
  const fake::Parm &method = node->fake_cook().parms.at("method");
  CHECK(method.type == "string" && method.text == sw_method_name(SW_METHOD_AUTO) && method.menu);
  const PRM_Name *item = method.menu->choiceNamesPtr();
  for (uint32_t k = 0; k < sw_method_count(); ++k, ++item) {
    CHECK(std::string(item->getToken()) == sw_method_name(sw_method_at(k)));
    CHECK(std::string(item->getLabel()) == sw_method_label(sw_method_at(k)));
  }
  CHECK(!item->getToken());
}

void every_method_of_the_table_moves_the_polygons_or_is_told_of() {
  int moved = 0;
  for (uint32_t k = 0; k < sw_method_count(); ++k) {
    Scene scene;
    scene.cook.set_text("method", sw_method_name(sw_method_at(k)));
    scene.cook.set("reducedfields", {6});
    scene.play(3);
    const std::vector<std::string> &errors = scene.cook.errors;
    CHECK(errors.empty() ? scene.tip() < -1e-4 : contains(errors[0], "not supported: "));
    moved += errors.empty();
    if (!errors.empty()) printf("   %s: %s\n", sw_method_name(sw_method_at(k)), errors[0].c_str());
  }
  CHECK(moved >= 8);
}

void every_parameter_changes_the_result() {
  const auto changes = [](const std::function<void(Scene &)> &prepare, const std::function<void(Scene &)> &change) {
    Scene before, after;
    prepare(before), prepare(after);
    change(after);
    const bool differ = !same(before.play(6), after.play(6));
    return differ && before.cook.errors.empty() && after.cook.errors.empty();
  };
  const auto nothing = [](Scene &) {};
  const auto number = [](const char *name, std::vector<double> x) { return [=](Scene &s) { s.cook.set(name, x); }; };
  const auto word = [](const char *name, const char *x) { return [=](Scene &s) { s.cook.set_text(name, x); }; };
  const auto material = number("stiffnessfrom", {1});
  CHECK(changes(nothing, number("time", {0.1})));
  CHECK(changes(nothing, number("startframe", {3})));
  CHECK(changes(nothing, number("framerate", {48})));
  CHECK(changes(nothing, number("gravity", {1, 2, 3})));
  const auto windy = [](Scene &s) { s.cook.set("wind", {0, 3, 2}), s.cook.set("airdensity", {1.2}); };
  CHECK(changes(windy, number("wind", {0, -3, 2})));
  CHECK(changes(windy, number("airdensity", {0.6})));
  CHECK(changes(windy, number("normaldrag", {0.5})));
  CHECK(changes(windy, number("tangentialdrag", {1})));
  CHECK(changes(nothing, material));
  CHECK(changes(nothing, number("frequency", {3})));
  CHECK(changes(number("stiffnessfrom", {4}), number("sag", {0.05})));
  CHECK(changes(nothing, number("thickness", {0.3})));
  CHECK(changes(material, number("kbend", {10})));
  CHECK(changes(material, number("kstretch", {10})));
  CHECK(changes(material, number("density", {2})));
  const auto known = number("stiffnessfrom", {2});
  const auto sheet = [](Scene &s) { s.cook.set("stiffnessfrom", {3}), s.cook.set("thickness", {1e-3}); };
  CHECK(changes(known, word("preset", "steel")));
  CHECK(changes(known, number("thickness", {2e-3})));
  CHECK(changes(known, number("metresperunit", {0.1})));
  CHECK(changes(sheet, number("young", {1e8})));
  CHECK(changes(sheet, number("poisson", {0})));
  CHECK(changes(sheet, number("volumedensity", {5000})));
  const std::pair<const char *, std::function<void(Scene &)>> maps[] = {
      {"thicknessmap", sheet}, {"youngmap", sheet}, {"densitymap", sheet}, {"densitymap", material}, {"densitymap", nothing}, {"bendmap", material}, {"stretchmap", material}};
  for (const auto &[map, by] : maps)
    CHECK(changes(
        [&](Scene &s) {
          by(s);
          std::vector<double> &painted = s.geometry().attributes["soft"];
          painted.assign(STRIP_VERTICES, 1);
          for (std::size_t i = 30; i < STRIP_VERTICES; ++i) painted[i] = 0.5;
        },
        word(map, "soft")));
  for (const std::function<void(Scene &)> &by : {std::function<void(Scene &)>(nothing), std::function<void(Scene &)>(material), std::function<void(Scene &)>(sheet)})
    CHECK(changes(by, [](Scene &s) {
      std::vector<double> &grown = s.geometry().attributes["grown"];
      grown.assign(STRIP_VERTICES, 1);
      for (std::size_t i = 30; i < STRIP_VERTICES; ++i) grown[i] = 1.02;
      s.cook.set_text("growthmap", "grown");
    }));
  CHECK(changes(nothing, number("dampingratio", {0.5})));
  CHECK(changes(nothing, number("dampingmass", {2})));
  CHECK(changes(nothing, number("dampingstiffness", {0.1})));
  CHECK(changes([](Scene &s) { s.geometry().attributes["calm"].assign(STRIP_VERTICES, 5); }, word("dampingmap", "calm")));
  CHECK(changes(nothing, number("stiffnessfactor", {2})));
  CHECK(changes(nothing, number("modes", {2})));
  CHECK(changes(nothing, number("doubleprecision", {1})));
  CHECK(changes(nothing, word("method", "lma")));
  CHECK(changes(word("method", "reduced-shell"), number("reducedfields", {3})));
  const auto choice = [](Scene &s) { s.cook.set_text("method", "auto"), s.cook.set("reducedfields", {6}); };
  CHECK(changes(choice, number("autoerror", {1e9})));
  CHECK(changes(nothing, number("correctionsteps", {1})));
  CHECK(changes(nothing, number("integrator", {1})));
  CHECK(changes(nothing, number("supportkind", {1})));
  CHECK(changes([](Scene &s) { s.geometry().group("more", {60, 61, 62}); }, word("supportgroup", "more")));
  CHECK(changes(
      [](Scene &s) {
        std::vector<double> &painted = s.geometry().attributes["pin"];
        painted.assign(STRIP_VERTICES, 0.3);
        painted[60] = 0.8;
      },
      word("supportattrib", "pin")));
  const auto same_points = [](const char *pattern) {
    Scene named, by_pattern;
    named.geometry().group("more", {0, 1, 2, 60, 61}), by_pattern.geometry().group("more", {0, 1, 2, 60, 61});
    named.cook.set_text("supportgroup", "more"), by_pattern.cook.set_text("supportgroup", pattern);
    return same(named.play(6), by_pattern.play(6)) && by_pattern.cook.errors.empty();
  };
  CHECK(same_points("0-2 60 61") && same_points("mo*") && same_points("held 60-61"));
  CHECK(changes(nothing, number("envelope", {0.5})));
  CHECK(changes([](Scene &s) { s.geometry().attributes["soft"].assign(STRIP_VERTICES, 0.5); },
                word("weightattrib", "soft")));
}

// A parameter of the collider at a time: each changes a strip that lies on it.
void every_parameter_of_the_collider_changes_the_result() {
  const auto changes = [](const char *name, std::vector<double> value) {
    Scene before, after;
    before.put_box(-0.03f), after.put_box(-0.03f);
    after.cook.set(name, std::move(value));
    return !same(before.play(8), after.play(8)) && before.cook.errors.empty() && after.cook.errors.empty();
  };
  CHECK(changes("collidershape", {1}));
  CHECK(changes("collidershape", {6}));
  CHECK(changes("collidercells", {9}));
  CHECK(changes("colliderfriction", {0}));
  CHECK(changes("colliderthickness", {0.01}));
  CHECK(changes("collidert", {0, 0.01, 0}));
  CHECK(changes("colliderr", {0, 0, -1}));
}

// Two boxes, each a piece: one under the middle, one under the end that is lifted point by point; what a piece has itself goes over the
// parameters.
void pieces_of_the_third_input_are_colliders_of_their_own() {
  const auto put = [](Scene &scene, int frame) {
    scene.put_box(-0.08f);
    fake::Geometry &boxes = scene.solid.fake_geometry();
    const std::vector<GEO_PrimPoly> box = boxes.primitives;
    for (int i = 0; i < 8; ++i) {
      const UT_Vector3 p = boxes.points[std::size_t(i)];
      boxes.points.emplace_back(p.x() - 2.2f, p.y() + 0.075f, p.z());
      boxes.points[std::size_t(i)] = UT_Vector3(p.x(), p.y() + 0.004f * float(frame), p.z());
    }
    for (const GEO_PrimPoly &face : box) {
      std::vector<GA_Index> corners = face.points;
      for (GA_Index &corner : corners) corner += 8;
      add_polygon(boxes, corners);
    }
    for (int k = 0; k < 12; ++k) boxes.texts_of_primitives["name"].push_back(k < 6 ? "end" : "middle"), boxes.of_primitives["class"].push_back(k < 6 ? 4 : 9);
  };
  Scene by_name, by_number, end_alone, own, deforming, wrong;
  const auto at = [&put](Scene &scene, int frame, const std::function<void(fake::Geometry &)> &change) {
    put(scene, frame);
    change(scene.solid.fake_geometry());
    return scene.at(frame);
  };
  const auto nothing = [](fake::Geometry &) {};
  double apart = 0;
  by_name.cook.set_text("colliderpieces", "name");
  by_number.cook.set_text("colliderpieces", "class");
  own.cook.set_text("colliderpieces", "name");
  deforming.cook.set_text("colliderpieces", "name");
  for (int frame = 1; frame <= 16; ++frame) {
    const Points named = at(by_name, frame, nothing);
    CHECK(same(at(by_number, frame, nothing), named));
    at(end_alone, frame, [](fake::Geometry &boxes) { boxes.primitives.resize(6); });
    apart = std::max(apart, std::fabs(end_alone.tip() - by_name.tip()));
    at(own, frame, [](fake::Geometry &boxes) {
      boxes.of_primitives["colliderfriction"].assign(12, 0);
      boxes.of_primitives["colliderthickness"].assign(12, 0.05);
      boxes.of_primitives["collidercells"].assign(12, 32);
      boxes.texts_of_primitives["collidershape"].assign(12, "box");
    });
    at(deforming, frame, [](fake::Geometry &boxes) { boxes.texts_of_primitives["collidershape"].assign(12, "deforming"); });
  }
  CHECK(by_name.tip() > -0.0165 && own.tip() > 0.0335);  // the end's box is at -0.016, and a grid keeps a hundredth of a cell of 0.03
  CHECK_NEAR(deforming.tip(), by_name.tip(), 0.01);  // another search, and no grid
  CHECK(apart > 0.003);
  for (Scene *scene : {&by_name, &by_number, &end_alone, &own, &deforming}) CHECK(scene->cook.errors.empty() && scene->cook.warnings.empty());
  wrong.cook.set_text("colliderpieces", "none");
  at(wrong, 2, nothing);
  CHECK(wrong.cook.errors.size() == 1 && contains(wrong.cook.errors[0], "the colliders' primitives have no text or integer none"));
  wrong.cook.set_text("colliderpieces", "name");
  at(wrong, 2, [](fake::Geometry &boxes) { boxes.texts_of_primitives["collidershape"].assign(12, "ball"); });
  CHECK(wrong.cook.errors.size() == 1 && contains(wrong.cook.errors[0], "the collider end: there is no shape 'ball'; there are plane, "));
}

// Of two boxes in one solid the one below comes up, and the one above down, as the solid turns: a strip of one mode bends one way.
void what_is_inside_a_collider_is_pushed_out_or_given_way_to() {
  const auto deepest = [](const std::function<void(Scene &)> &change, std::size_t warnings) {
    Scene scene;
    scene.cook.set("modes", {1});
    scene.cook.set_text("supportgroup", "0-2 120-122");
    scene.put_box(0);
    fake::Geometry &boxes = scene.solid.fake_geometry();
    const std::vector<GEO_PrimPoly> box = boxes.primitives;
    boxes.points.clear();
    for (int i = 0; i < 16; ++i)
      boxes.points.emplace_back((i < 8 ? -1.0f : 1.0f) + (i & 1 ? 0.2f : -0.2f), (i < 8 ? -0.23f : 0.23f) + (i & 2 ? 0.2f : -0.2f), i & 4 ? 0.5f : -0.5f);
    for (const GEO_PrimPoly &face : box) {
      std::vector<GA_Index> corners = face.points;
      for (GA_Index &corner : corners) corner += 8;
      add_polygon(boxes, corners);
    }
    change(scene);
    const auto turn = [](int frame) { return 0.006 * std::min(frame, 14); };
    for (int frame = 1; frame <= 16; ++frame) {
      scene.cook.set("collidert", {2, 0, 0});
      scene.cook.set("colliderr", {0, 0, -57.29577951308232 * turn(frame)});
      scene.at(frame);
    }
    CHECK(scene.cook.errors.empty() && scene.cook.warnings.size() == warnings);
    double deep = 0;
    for (const UT_Vector3 &p : scene.cook.output.fake_geometry().points) {
      const double c = std::cos(turn(16)), s = std::sin(turn(16)), x = c * (double(p.x()) - 2) - s * double(p.y()),
                   y = s * (double(p.x()) - 2) + c * double(p.y());
      if (std::fabs(std::fabs(x) - 1) < 0.2) deep = std::max(deep, x < 0 ? -0.03 - y : y - 0.03);
    }
    return deep;
  };
  const double plain = deepest([](Scene &) {}, 1);
  CHECK(plain > 0.02);
  CHECK(deepest([](Scene &s) { s.cook.set("pushout", {1}); }, 0) < 3e-4);  // a hundredth of a cell of the grid, of 2.4 in 64
  CHECK(deepest([](Scene &s) { s.cook.set_text("contactpatches", "90-92"); }, 0) < 0.3 * plain);
  // The boxes begin 0.03 off the strip.
  CHECK(deepest([](Scene &s) { s.cook.set("contactpatchesnear", {0.04}), s.cook.set("contactpatchesmost", {6}); }, 0) < 0.3 * plain);
}

void polygons_of_the_third_input_stop_the_strip_and_lift_it() {
  Scene free;
  double unstopped = 0;
  for (int frame = 1; frame <= 16; ++frame) free.at(frame), unstopped = std::min(unstopped, free.tip());
  CHECK(unstopped < -0.1);
  for (const int shape : {3, 4, 5}) {  // box, hull, mesh
    Scene scene;
    scene.put_box(-0.08f);
    scene.cook.set("collidershape", {double(shape)});
    double lowest = 0;
    for (int frame = 1; frame <= 16; ++frame) scene.at(frame), lowest = std::min(lowest, scene.tip());
    CHECK_NEAR(lowest, -0.08, 5e-4);  // a grid of 64 cells of 0.03 keeps a hundredth of one
    for (int frame = 17; frame <= 30; ++frame) {
      scene.cook.set("collidert", {0, 0.02 * (frame - 16), 0});
      scene.at(frame);
    }
    CHECK(scene.tip() > 0.195 && scene.cook.errors.empty());  // the top is at 0.2
  }
}

// One polygon, seen from above: solid under it where it is one-sided, and refused where it is not.
void an_open_ground_stops_the_strip_where_it_is_one_sided() {
  for (const int shape : {5, 6}) {  // mesh, deforming mesh
    Scene scene;
    scene.put_box(-0.08f);
    scene.solid.fake_geometry().primitives.resize(4);
    scene.solid.fake_geometry().primitives.erase(scene.solid.fake_geometry().primitives.begin(), scene.solid.fake_geometry().primitives.begin() + 3);
    scene.cook.set("collidershape", {double(shape)});
    scene.at(1);
    CHECK(scene.cook.errors.size() == 1 && contains(scene.cook.errors[0], "the collider: "));
    scene.cook.set("collideronesided", {1});
    scene.cook.set("colliderdepth", {0.3});
    double lowest = 0;
    for (int frame = 1; frame <= 16; ++frame) scene.at(frame), lowest = std::min(lowest, scene.tip());
    CHECK(scene.cook.errors.empty());
    CHECK_NEAR(lowest, -0.08, 5e-4);
  }
}

// What a scene keeps is the name, which is for good.
void the_menu_of_known_materials_is_the_librarys_table() {
  const std::unique_ptr<SOP_Node> node = plugin->create();
  const fake::Parm &preset = node->fake_cook().parms.at("preset");
  CHECK(preset.type == "string" && preset.menu);
  const PRM_Name *item = preset.menu->choiceNamesPtr();
  for (uint32_t k = 0; k < sw_preset_count(); ++k, ++item) {
    CHECK(std::string(item->getToken()) == sw_preset_name(k));
    CHECK(std::string(item->getLabel()) == sw_preset_label(k));
  }
  CHECK(!item->getToken());
}

// Steel by name is steel by its numbers.
void a_known_material_is_the_sheet_of_its_numbers() {
  Scene named, numbers;
  named.cook.set("stiffnessfrom", {2});
  named.cook.set_text("preset", "steel");
  numbers.cook.set("stiffnessfrom", {3});
  numbers.cook.set("young", {2.07e11});
  numbers.cook.set("poisson", {0.3});
  numbers.cook.set("thickness", {5e-4});
  numbers.cook.set("volumedensity", {7850});
  named.play(10), numbers.play(10);
  CHECK(named.tip() < -1e-3);
  CHECK_NEAR(numbers.tip(), named.tip(), 1e-6 * std::fabs(named.tip()));  // P is in floats
}

// A moving frame is what shakes the shell: rotation and translation are animated parameters.
// A map of twos is a sheet of twice the thickness, to the rounding of its constants; what is not above 0 is named.
void a_map_multiplies_the_sheets_constant() {
  const auto sheet = [](Scene &s, double thickness) { s.cook.set("stiffnessfrom", {3}), s.cook.set("thickness", {thickness}); };
  Scene thick, mapped, broken;
  sheet(thick, 2e-3), sheet(mapped, 1e-3), sheet(broken, 1e-3);
  mapped.geometry().attributes["twice"].assign(STRIP_VERTICES, 2);
  mapped.cook.set_text("thicknessmap", "twice");
  broken.geometry().attributes["twice"].assign(STRIP_VERTICES, 2);
  broken.geometry().attributes["twice"][7] = 0;
  broken.cook.set_text("thicknessmap", "twice");
  const Points a = thick.play(8), b = mapped.play(8);
  for (std::size_t i = 0; i < a.size(); ++i) CHECK_NEAR(a[i].y(), b[i].y(), 1e-6);  // the basis in floats of 4
  broken.at(2);
  CHECK(broken.cook.errors.size() == 1 && contains(broken.cook.errors[0], "the map of the thickness is 0 at point 7; it must be above 0"));
}

void a_map_multiplies_the_papers_constant() {
  for (const auto &[parameter, map] : {std::pair("kbend", "bendmap"), std::pair("kstretch", "stretchmap"), std::pair("density", "densitymap")}) {
    Scene plain, constant, mapped, broken;
    for (Scene *s : {&plain, &constant, &mapped, &broken})
      s->cook.set("stiffnessfrom", {1}), s->cook.set("kbend", {1e-3}), s->cook.set("kstretch", {10}), s->cook.set("density", {1});
    constant.cook.set(parameter, {parameter == std::string("kbend") ? 2e-3 : parameter == std::string("kstretch") ? 20.0 : 2.0});
    for (Scene *s : {&mapped, &broken}) s->geometry().attributes["twice"].assign(STRIP_VERTICES, 2), s->cook.set_text(map, "twice");
    broken.geometry().attributes["twice"][7] = -1;
    const Points first = plain.play(8), a = constant.play(8), b = mapped.play(8);
    double apart = 0, changed = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
      apart = std::max(apart, double(std::fabs(a[i].y() - b[i].y()))), changed = std::max(changed, double(std::fabs(a[i].y() - first[i].y())));
    CHECK(apart <= 1e-3 * changed);  // rounding of the constants, against what they do
    broken.at(2);
    CHECK(broken.cook.errors.size() == 1 && contains(broken.cook.errors[0], " is -1 at point 7; it must be above 0"));
  }
}

// Without gravity a fold of 60 degrees is where the strip rests: convex below, from where Houdini shows these polygons.
void edges_of_a_group_fold() {
  const auto group = [](Scene &s) {
    for (int j = 0; j < 2; ++j)
      s.geometry().edge_groups["fold"].edges.emplace_back(fake::Geometry::offset(60 + j), fake::Geometry::offset(61 + j));
    s.cook.set_text("creasegroup", "fold");
  };
  Scene folded, softer, plain, wrong, own;
  // Two folds with numbers of their own, by the points at their ends: 90 degrees up and 90 down is a step.
  group(own);
  std::vector<GA_Edge> &edges = own.geometry().edge_groups["fold"].edges;
  for (int j = 0; j < 2; ++j) edges.emplace_back(fake::Geometry::offset(90 + j), fake::Geometry::offset(91 + j));
  std::vector<double> &angles = own.geometry().attributes["creaseangle"];
  angles.assign(STRIP_VERTICES, 0);
  for (int j = 0; j < 3; ++j) angles[std::size_t(60 + j)] = 60, angles[std::size_t(90 + j)] = -60;
  own.geometry().attributes["creasefactor"].assign(STRIP_VERTICES, 2);
  own.cook.set("gravity", {0, 0, 0});
  own.cook.set("creasesetsangle", {1});
  own.at(1);
  CHECK_NEAR(own.tip(), 1 * std::sin(1.0471975511965976), 0.01);
  CHECK_NEAR(own.cook.output.fake_geometry().points[kTip].x(), 3.5, 0.01);
  group(folded);
  folded.cook.set("gravity", {0, 0, 0});
  folded.cook.set("creasesetsangle", {1});
  folded.cook.set("creaseangle", {60});
  folded.at(1);
  CHECK_NEAR(folded.cook.output.fake_geometry().points[kTip].x(), 3, 0.01);
  CHECK_NEAR(folded.tip(), 1.73, 0.01);
  for (Scene *scene : {&softer, &plain}) scene->cook.set("stiffnessfrom", {3}), scene->cook.set("thickness", {0.02}), scene->cook.set("dampingratio", {0.9});
  group(softer);
  softer.play(20), plain.play(20);
  CHECK(softer.tip() < plain.tip() - 1e-3);
  softer.cook.set("creasefactor", {1});
  softer.play(20);
  CHECK_NEAR(softer.tip(), plain.tip(), 1e-5);  // floats of 4: as without
  // By the parameter, and by an attribute of points that goes over it.
  const auto yielding = [&group](double degrees, double of_points) {
    Scene scene;
    group(scene);
    scene.cook.set("stiffnessfrom", {3}), scene.cook.set("thickness", {0.02}), scene.cook.set("dampingratio", {0});
    scene.cook.set_text("method", "shell-implicit");
    scene.cook.set("creaseyield", {degrees});
    if (of_points >= 0) scene.geometry().attributes["creaseyield"].assign(STRIP_VERTICES, of_points);
    scene.play(20);
    CHECK(scene.cook.errors.empty());
    return scene.tip();
  };
  const double elastic = yielding(0, -1), yielded = yielding(0.1, -1);
  CHECK(std::fabs(yielded - elastic) > 1e-2);  // another swing: lower or higher by frame 20
  CHECK(yielding(0, 0.1) == yielded && yielding(0.1, 0) == elastic);
  wrong.cook.set_text("creasegroup", "none");
  wrong.at(1);
  CHECK(wrong.cook.errors.size() == 1 && contains(wrong.cook.errors[0], "there are no edges of the group none"));
}

void an_attribute_is_the_shape_without_stress() {
  Scene scene;
  std::vector<double> &curled = scene.geometry().attributes["rest"];
  for (const UT_Vector3 &p : scene.geometry().points)
    curled.insert(curled.end(), {4 * std::sin(double(p.x()) / 4), 4 * (1 - std::cos(double(p.x()) / 4)), double(p.z())});
  scene.cook.set("gravity", {0, 0, 0});
  scene.cook.set_text("restshape", "rest");
  scene.at(1);
  CHECK_NEAR(scene.tip(), 4 * (1 - std::cos(3.9 / 4)), 0.1);  // the clamp holds the first of 40 columns flat
  scene.cook.set_text("restshape", "none");
  scene.at(1);
  CHECK(scene.cook.errors.size() == 1 && contains(scene.cook.errors[0], "there is no point attribute none of three numbers"));
}

void fibres_run_along_a_direction_or_an_attribute() {
  const auto sag = [](const std::function<void(Scene &)> &change) {
    Scene scene;
    scene.cook.set("stiffnessfrom", {3});
    scene.cook.set("thickness", {0.05});
    scene.cook.set("young", {1e11});
    scene.cook.set("youngacross", {1e10});
    scene.cook.set("dampingratio", {0.9});
    change(scene);
    scene.play(24);
    CHECK(scene.cook.errors.empty());
    return -scene.tip();
  };
  const auto of = [](bool points, double x, double z) {
    return [=](Scene &s) {
      std::vector<double> &along = points ? s.geometry().attributes["fibre"] : s.geometry().of_primitives["fibre"];
      for (std::size_t k = 0; k < (points ? s.geometry().points.size() : s.geometry().primitives.size()); ++k) along.insert(along.end(), {x, 0, z});
      s.cook.set_text("directions", "fibre");
    };
  };
  const double along = sag([](Scene &) {}), across = sag([](Scene &s) { s.cook.set("direction", {0, 0, 1}); });
  CHECK(across > 5 * along);
  for (const bool points : {true, false}) {
    CHECK(sag(of(points, 2, 0)) == along);  // of any length
    CHECK(sag(of(points, 0, 3)) == across);
  }
  CHECK(sag([](Scene &s) { s.cook.set("shear", {1e8}), s.cook.set("direction", {1, 0, 1}); }) != sag([](Scene &s) { s.cook.set("direction", {1, 0, 1}); }));
}

// By the fourth input: attributes of the first input, whose points and primitives come in another order, act as they do without it.
void maps_and_fibres_are_those_of_the_first_input_beside_a_fourth() {
  const auto tip = [](bool by_fourth, const std::string &what) {
    Scene scene;
    scene.cook.set("stiffnessfrom", {3}), scene.cook.set("thickness", {0.05}), scene.cook.set("young", {1e11});
    const GU_Detail simulated = scene.mesh;
    fake::Geometry &drawn = scene.geometry();
    const std::size_t n = drawn.points.size();
    if (by_fourth) {
      std::reverse(drawn.points.begin(), drawn.points.end());
      std::reverse(drawn.primitives.begin(), drawn.primitives.end());
      for (auto &primitive : drawn.primitives)
        for (auto &point : primitive.points) point = static_cast<std::decay_t<decltype(point)>>(n - 1 - std::size_t(point));
      scene.cook.inputs[3] = &simulated;
      scene.cook.set_text("supportgroup", "");
      std::vector<double> &held = drawn.attributes["pin"];
      held.assign(n, 0);
      for (std::size_t j = 0; j < STRIP_ROWS; ++j) held[n - 1 - j] = 1;
      scene.cook.set_text("supportattrib", "pin");
    }
    if (what == "directions") {
      scene.cook.set("youngacross", {1e10});
      std::vector<double> &along = drawn.of_primitives["fibre"];
      for (const auto &primitive : drawn.primitives) {
        const bool near = drawn.points[std::size_t(primitive.points[0])].x() < 2;
        along.insert(along.end(), {near ? 1.0 : 0.0, 0, near ? 0.0 : 1.0});
      }
      scene.cook.set_text("directions", "fibre");
    } else if (!what.empty()) {
      std::vector<double> &map = drawn.attributes["painted"];
      for (const UT_Vector3 &p : drawn.points) map.push_back(p.x() < 2 ? 4 : 1);
      if (what == "bendmap") scene.cook.set("stiffnessfrom", {1}), scene.cook.set("kbend", {1e-3}), scene.cook.set("kstretch", {10});
      scene.cook.set_text(what.c_str(), "painted");
    }
    scene.play(10);
    CHECK(scene.cook.errors.empty());
    return double(scene.cook.output.fake_geometry().points[by_fourth ? n - 1 - kTip : kTip].y());
  };
  const double plain = tip(false, "");
  for (const char *what : {"directions", "thicknessmap", "youngmap", "densitymap", "dampingmap", "bendmap"}) {
    const double alone = tip(false, what);
    CHECK(std::fabs(alone - plain) > 1e-4);
    CHECK_NEAR(tip(true, what), alone, 1e-5);  // floats of the binding, of 4
  }
}

void points_are_held_along_axes() {
  Scene scene, free;
  float lowest = 0, lowest_free = 0;
  std::vector<double> &axes = scene.geometry().attributes["roller"];
  axes.assign(STRIP_VERTICES, 0);
  for (int j = 0; j < STRIP_ROWS; ++j) axes[std::size_t(kTip - 1 + j)] = SW_AXIS_Y;
  scene.cook.set_text("supportaxes", "roller");
  for (int frame = 1; frame <= 12; ++frame) {
    scene.at(frame), free.at(frame);
    CHECK(scene.tip() == 0);
    lowest = std::min(lowest, scene.cook.output.fake_geometry().points[72].y());
    lowest_free = std::min(lowest_free, float(free.tip()));
  }
  CHECK(scene.cook.errors.empty() && lowest < -0.005f && lowest_free < -0.05f);
  const auto rise = [](double value) {
    Scene half;
    half.geometry().attributes["roller"].assign(STRIP_VERTICES, 0);
    for (int j = 0; j < STRIP_ROWS; ++j) half.geometry().attributes["roller"][std::size_t(kTip - 1 + j)] = value;
    half.cook.set_text("supportaxes", "roller");
    for (int frame = 1; frame <= 12; ++frame) half.at(frame);
    CHECK(half.cook.errors.empty());
    return std::abs(half.tip() - double(half.cook.output.fake_geometry().points[std::size_t(kTip - STRIP_ROWS)].y()));
  };
  CHECK(rise(8 * SW_AXIS_X) < 0.1 * rise(SW_AXIS_X));  // a plane of symmetry: the slope is held, too
  scene.cook.set_text("supportaxes", "none");
  scene.at(1);
  CHECK(scene.cook.errors.size() == 1 && contains(scene.cook.errors[0], "there is no integer of points none"));
}

// The strip without the triangles between columns 20 and 21, tied there in each way.
void pieces_are_tied() {
  const auto tip = [](const std::function<void(Scene &)> &change) {
    Scene scene;
    std::vector<GEO_PrimPoly> &all = scene.geometry().primitives, left;
    for (const GEO_PrimPoly &polygon : all) {
      std::set<GA_Index> columns;
      for (const GA_Index i : polygon.points) columns.insert(i / STRIP_ROWS);
      if (columns != std::set<GA_Index>{20, 21}) left.push_back(polygon);
    }
    all = left;
    GEO_PrimPoly line;  // of two points: it is no polygon, and counts as a primitive
    line.points = {0, 1};
    all.insert(all.begin(), line);
    scene.cook.set("stiffnessfrom", {1});  // by frequency a softer tie has a faster clock
    scene.cook.set("gravity", {0, -0.02, 0});
    scene.cook.set("dampingratio", {0.9});
    change(scene);
    scene.play(80);
    CHECK(scene.cook.errors.empty());
    return scene.tip();
  };
  const auto ties = [](bool faces, double stiffness) {
    return [=](Scene &s) {
      std::vector<double> &to = s.geometry().attributes["partner"];
      to.assign(STRIP_VERTICES, -1);
      for (int j = 0; j < 2 * STRIP_ROWS; ++j) {  // two rows, as one is a hinge
        const GA_Index point = 20 * STRIP_ROWS + j % STRIP_ROWS;
        std::size_t face = 0;
        for (std::size_t t = 0; t < s.geometry().primitives.size(); ++t)
          for (const GA_Index i : s.geometry().primitives[t].points)
            if (i == point) face = t;
        to[std::size_t(21 * STRIP_ROWS + j)] = faces ? double(face) : double(point);
      }
      s.cook.set_text(faces ? "tietoface" : "tieto", "partner");
      s.cook.set("tiestiffness", {stiffness});
    };
  };
  const double loose = tip([](Scene &) {}), tied = tip(ties(false, 0));
  CHECK(tied < 0 && tied > 0.7 * loose);
  CHECK_NEAR(tip(ties(true, 0)), tied, 0.1 * std::fabs(tied));  // each by triangles of its own
  CHECK_NEAR(tip([](Scene &s) { s.cook.set("tiewithin", {0.21}); }), tied, 0.1 * std::fabs(tied));  // an edge is 0.1
  CHECK(tip(ties(false, 20)) < 1.02 * tied);
}

void a_moving_support_frame_shakes_the_shell() {
  for (const char *name : {"framet", "framer"}) {
    Scene still, shaken;
    for (int frame = 1; frame <= 10; ++frame) {
      shaken.cook.set(name, {0, 0, 0.1 * frame * frame});
      shaken.at(frame);
      still.at(frame);
    }
    CHECK(!same(shaken.at(10), still.at(10)) && shaken.cook.errors.empty());
  }
}

void envelope_and_weights_scale_each_point() {
  Scene plain, part, none;
  const Points full = plain.play(10);
  part.cook.set("envelope", {0.5});
  std::vector<double> &weights = part.geometry().attributes["soft"];
  weights.assign(STRIP_VERTICES, 1);
  weights[kTip] = 0.5;
  part.cook.set_text("weightattrib", "soft");
  const Points out = part.play(10);
  for (int i = 0; i < STRIP_VERTICES; ++i)
    CHECK_NEAR(out[std::size_t(i)].y(), (i == kTip ? 0.25 : 0.5) * full[std::size_t(i)].y(), 1e-6);  // floats
  none.cook.set("envelope", {0});
  CHECK(same(none.play(5), none.geometry().points) && none.cook.output.getP()->bumps == 0);
}

// -------------------------------------------------------------------------------------------------------- what is drawn

// Both ends held in two columns; the far one comes nearer and turns.
Points part(Scene &scene, int last) {
  scene.cook.set("supportkind", {1});
  scene.cook.set_text("supportgroup", "0-5 117-122");
  const Points rest = scene.geometry().points;
  for (int frame = 1; frame <= last; ++frame) {
    const float angle = 0.06f * float(frame - 1);
    for (std::size_t i = STRIP_ROWS * (STRIP_COLUMNS - 2); i < rest.size(); ++i)
      scene.geometry().points[i] = UT_Vector3(rest[i].x() - 0.01f * float(frame - 1), -std::sin(angle) * rest[i].z(), std::cos(angle) * rest[i].z());
    scene.at(frame);
  }
  return scene.cook.output.fake_geometry().points;
}

// The input bends whole: the shell swings about that, and a dropped cache changes nothing.
void the_whole_input_leads_the_shell_as_its_rest_shape() {
  Scene kept, dropped;
  dropped.cook.keep_cache = false;
  const Points rest = kept.geometry().points;
  float lift = 0;
  for (int frame = 1; frame <= 24; ++frame) {
    lift = 0.02f * float(frame - 1);
    for (Scene *scene : {&kept, &dropped}) {
      scene->cook.set("followrest", {1});
      scene->cook.set("frequency", {20});
      for (std::size_t i = 0; i < rest.size(); ++i) scene->geometry().points[i] = UT_Vector3(rest[i].x(), lift * rest[i].x() * rest[i].x() / 4, rest[i].z());
    }
    CHECK(same(dropped.at(frame), kept.at(frame)));
  }
  CHECK(kept.cook.errors.empty() && dropped.cook.errors.empty());
  const double shape = double(lift) * 4;  // at x = 4
  CHECK_NEAR(kept.tip(), shape, 0.03);    // it sags by 1.5 g / (2 pi 20)²
  CHECK(kept.tip() != shape);
}

void held_points_of_the_input_lead_the_shell_or_are_told_of() {
  Scene scene, few, off, dropped, refused;
  const Points out = part(scene, 12);
  CHECK(scene.cook.errors.empty() && scene.cook.warnings.empty());
  for (const std::size_t i : {0, 5, 117, 122})
    CHECK_NEAR(out[i].y(), scene.geometry().points[i].y(), 1e-6);  // floats
  const std::size_t middle = STRIP_ROWS * (STRIP_COLUMNS / 2);
  const double tilt = std::atan2(out[middle + 2].y() - out[middle].y(), out[middle].z() - out[middle + 2].z());
  CHECK_NEAR(tilt, 0.5 * 0.06 * 11, 0.1);  // the middle of a strip turns by half of what its end does
  few.cook.set("supportfields", {1});
  CHECK(!same(part(few, 12), out));
  Scene fewer;
  fewer.cook.set("supportfields", {1});
  part(fewer, 24);
  CHECK(fewer.cook.warnings.size() == 1 && contains(fewer.cook.warnings[0], "off them: more support fields"));
  off.cook.set("follow", {0});
  CHECK(!same(part(off, 12), out) && off.cook.errors.empty());
  dropped.cook.keep_cache = false;  // the node goes on with its shell, though its points have moved
  CHECK(same(part(dropped, 12), out) && dropped.cook.warnings.empty());
  refused.cook.set_text("method", "rotation-strain");
  part(refused, 12);
  CHECK(contains(refused.cook.errors.at(0), "rotation-strain follows them as one only; take the warp or a full shell"));
  CHECK(same(refused.cook.output.fake_geometry().points, refused.geometry().points));
}

// v against the positions a thousandth of a frame apart; what came in with a motion of its own keeps it where that is carried along.
void velocities_are_those_of_the_positions() {
  Scene replaced;
  replaced.geometry().attributes["v"].assign(3 * STRIP_VERTICES, 2);
  replaced.cook.set("velocity", {1});
  replaced.play(10);
  const std::vector<double> own = replaced.cook.output.fake_geometry().attributes["v"];
  Scene scene;
  scene.cook.set("follow", {0});
  scene.geometry().attributes["v"].assign(3 * STRIP_VERTICES, 2);
  scene.cook.set("velocity", {1});
  scene.cook.set("doubleprecision", {1});
  scene.play(10);
  const Points before = scene.cook.output.fake_geometry().points;
  const std::vector<double> v = scene.cook.output.fake_geometry().attributes["v"];
  CHECK(scene.cook.output.fake_geometry().bumps["v"] == 1);
  for (std::size_t i = 0; i < v.size(); ++i) CHECK_NEAR(own[i], v[i] - 2, 1e-4);  // floats, and the basis in them
  const double frames = 0.02;
  const Points after = scene.at(10 + frames);
  double fastest = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    const double seen = double(after[i].y() - before[i].y()) * 24 / frames;
    CHECK_NEAR(v[3 * i + 1] - 2, seen, 0.05);  // P's floats of 1e-7 over 1e-3 s, and half a step's acceleration
    fastest = std::max(fastest, std::fabs(v[3 * i + 1] - 2));
  }
  CHECK(fastest > 0.5);

  Scene plain;
  plain.play(3);
  CHECK(plain.cook.output.fake_geometry().attributes.count("v") == 0);
  Scene made;
  made.cook.set("velocity", {1});
  made.play(3);
  CHECK(made.cook.output.fake_geometry().vectors.count("v") == 1);
}

void normals_of_points_are_those_of_the_bent_polygons() {
  Scene scene;
  scene.geometry().attributes["N"].assign(3 * STRIP_VERTICES, 0);
  scene.play(20);
  const fake::Geometry &out = scene.cook.output.fake_geometry();
  for (int i = 0; i < STRIP_VERTICES; ++i) {
    const double *n = &out.attributes.at("N")[3 * std::size_t(i)];
    CHECK_NEAR(n[0] * n[0] + n[1] * n[1] + n[2] * n[2], 1, 1e-6);
  }
  // At the tip the strip has turned about z: the normal is across it, by two points of its middle row.
  const UT_Vector3 a = out.points[kTip - 3], b = out.points[kTip];
  const double *n = &out.attributes.at("N")[3 * std::size_t(kTip)];
  const double along = (double(b.x() - a.x()) * n[0] + double(b.y() - a.y()) * n[1]) / std::hypot(b.x() - a.x(), b.y() - a.y());
  CHECK(std::fabs(along) < 0.05 && std::fabs(n[1]) < 0.999);
  CHECK(scene.cook.warnings.empty());
}

// Vertices that came in with one normal at a point stay smooth, as points are; a hard edge across the strip stays hard.
void normals_of_vertices_are_those_of_the_bent_polygons() {
  Scene smooth, hard;
  for (Scene *scene : {&smooth, &hard}) {
    scene->geometry().attributes["N"].assign(3 * STRIP_VERTICES, 0);
    for (const GEO_PrimPoly &polygon : scene->geometry().primitives) {
      const GA_Index last = *std::max_element(polygon.points.begin(), polygon.points.end());
      const double side = scene == &hard && last / STRIP_ROWS > 20 ? 0.2 : 0;
      for (std::size_t k = 0; k < polygon.points.size(); ++k) {
        std::vector<double> &of_vertices = scene->geometry().of_vertices["N"];
        of_vertices.insert(of_vertices.end(), {side, -1, 0});
      }
    }
    scene->play(20);
    CHECK(scene->cook.warnings.empty() && scene->cook.output.fake_geometry().bumps["N"] == 2);
  }
  int same_as_point = 0, parted = 0;
  for (Scene *scene : {&smooth, &hard}) {
    const fake::Geometry &out = scene->cook.output.fake_geometry();
    std::size_t vertex = 0;
    for (const GEO_PrimPoly &polygon : out.primitives)
      for (const GA_Index point : polygon.points) {
        const double *n = &out.of_vertices.at("N")[3 * vertex++], *p = &out.attributes.at("N")[3 * std::size_t(point)];
        CHECK_NEAR(n[0] * n[0] + n[1] * n[1] + n[2] * n[2], 1, 1e-6);
        const bool as_point = std::fabs(n[0] - p[0]) < 1e-6 && std::fabs(n[1] - p[1]) < 1e-6;
        const bool at_edge = scene == &hard && point / STRIP_ROWS == 20;
        CHECK(as_point || at_edge);
        same_as_point += as_point, parted += !as_point;
      }
  }
  CHECK(same_as_point > 900 && parted >= 10);  // of 960; each side of the edge has a bend of its own
}

// A sheet of quads of two sides, a little above and below, follows the strip: as the strip's own points where they coincide, and its
// groups and handles are named by its own points.
void the_first_input_follows_what_is_simulated() {
  Scene own, led;
  const GU_Detail strip = led.mesh;
  GU_Detail sheet;
  fake::Geometry &drawn = sheet.fake_geometry();
  for (const float side : {0.02f, -0.02f, 0.0f})
    for (const UT_Vector3 &p : strip.fake_geometry().points) drawn.points.emplace_back(p.x(), side, p.z());
  add_polygon(drawn, {0, 1, 4, 3});  // any faces: two sides that share no edge
  add_polygon(drawn, {3, 4, 1, 0});
  drawn.group("held", {0, 1, 2});
  led.cook.inputs[0] = &sheet;
  led.cook.inputs[3] = &strip;
  double lowest = 0;
  for (int frame = 1; frame <= 12; ++frame) {
    const Points alone = own.at(frame), out = led.at(frame);
    lowest = std::min(lowest, own.tip());
    for (std::size_t i = 0; i < alone.size(); ++i) {
      const UT_Vector3 middle = out[i + 2 * alone.size()], up = out[i], down = out[i + alone.size()];
      CHECK_NEAR(middle.x(), alone[i].x(), 1e-5);  // floats of the binding, of 4
      CHECK_NEAR(middle.y(), alone[i].y(), 1e-5);
      const double thick = std::hypot(std::hypot(up.x() - down.x(), up.y() - down.y()), up.z() - down.z());
      CHECK_NEAR(thick, 0.04, 4e-4);  // a hundredth: points off the surface keep their distance
    }
  }
  CHECK(lowest < -0.05 && led.cook.errors.empty() && led.cook.warnings.empty());

  led.lead(kTip, UT_Vector3(3.9f, 0.3f, 0));
  for (int frame = 13; frame <= 40; ++frame) led.at(frame);
  const UT_Vector3 tip = led.cook.output.fake_geometry().points[kTip];
  CHECK_NEAR(tip.y(), 0.3, 0.02);  // the strip's vertex is led so; the drawn one is 0.02 beside it and turns
  led.lead(3 * STRIP_VERTICES, UT_Vector3());
  led.at(40);
  CHECK(led.cook.errors.size() == 1 && contains(led.cook.errors[0], "but there are 369"));
  led.cook.inputs[1] = nullptr;
  GU_Detail broken = strip;
  broken.fake_geometry().primitives[2].closed = false;
  led.cook.inputs[3] = &broken;
  led.at(40);
  CHECK(led.cook.errors.size() == 1 && contains(led.cook.errors[0], "the fourth input: primitive 2 is no closed polygon"));
}

void the_menus_of_groups_and_attributes_are_houdinis() {
  const std::unique_ptr<SOP_Node> node = plugin->create();
  const auto &parms = node->fake_cook().parms;
  for (const char *name : {"supportgroup", "contactpatches"}) CHECK(parms.at(name).menu == &SOP_Node::pointGroupMenu);
  for (const char *name : {"supportattrib", "weightattrib", "dampingmap"}) CHECK(parms.at(name).menu == &SOP_Node::pointAttribReplaceMenu);
}

// ------------------------------------------------------------------------------------------------------------- handles

void a_handle_point_leads_its_point() {
  Scene scene;
  for (int frame = 1; frame <= 12; ++frame) {
    scene.lead(kTip, UT_Vector3(3.9f, 0.03f * float(frame), 0));
    scene.at(frame);
  }
  const UT_Vector3 tip = scene.cook.output.fake_geometry().points[kTip];
  CHECK_NEAR(tip.x(), 3.9, 2e-5);  // met to a millionth of the size of 4, the basis in floats
  CHECK_NEAR(tip.y(), 0.36, 2e-5);
  CHECK(scene.cook.warnings.empty() && scene.cook.errors.empty());
}

void attributes_of_a_handle_point_are_read() {
  const auto changes = [](const char *name, std::vector<double> value, bool turned) {
    Scene before, after;
    for (Scene *scene : {&before, &after}) {
      scene->lead(kTip, UT_Vector3(3.8f, 0.4f, 0));
      if (turned) scene->handles.fake_geometry().attributes["orient"] = {0, 0, std::sin(0.2), std::cos(0.2)};
    }
    after.handles.fake_geometry().attributes[name] = std::move(value);
    return !same(before.play(4), after.play(4)) && after.cook.errors.empty();
  };
  CHECK(changes("holdposition", {0}, false));
  CHECK(changes("holdorientation", {1}, true));
  CHECK(changes("compliance", {0.5}, false));
  CHECK(changes("held", {0}, false));
  CHECK(changes("axes", {SW_AXIS_Y}, false));
}

// Against a wind of v the air pushes as much as half the card's weight pulls where 1/2 rho C v² is half of g times its mass an area.
void wind_carries_a_known_material_by_its_own_weight() {
  const auto sag = [](double wind) {
    Scene scene;
    scene.cook.set("stiffnessfrom", {3});
    scene.cook.set("young", {3e10});  // stiff: it stays flat, and so the whole face is across the wind
    scene.cook.set("thickness", {4e-2});
    scene.cook.set("volumedensity", {10});  // 0.4 kg/m²
    scene.cook.set("dampingratio", {0.7});
    scene.cook.set("wind", {0, wind, 0});
    scene.cook.set("airdensity", {1.2});
    return scene.play(60)[kTip].y();
  };
  const double speed = std::sqrt(0.5 * 0.4 * 9.81 / (0.5 * 1.2 * 1.5)), still = sag(0);
  CHECK_NEAR(sag(speed), 0.5 * still, 0.05 * std::fabs(still));  // it has not come quite to rest
}

// Wind by an attribute is the wind of the parameter where it is the same, turns with the geometry, and may be there on one half alone.
void an_attribute_of_points_is_wind() {
  const auto tip = [](bool by_attribute, bool turned, bool half) {
    Scene scene;
    scene.cook.set("gravity", {0, 0, 0});
    scene.cook.set("airdensity", {1.2});
    if (turned) scene.cook.set("framer", {180, 0, 0});
    if (by_attribute) {
      std::vector<double> &air = scene.geometry().attributes["air"];
      for (int i = 0; i < STRIP_VERTICES; ++i) air.insert(air.end(), {0, half && i > STRIP_VERTICES / 2 ? 0.0 : 3.0, 0});
      scene.cook.set_text("windattrib", "air");
    } else {
      scene.cook.set("wind", {0, 3, 0});
    }
    scene.play(8);
    CHECK(scene.cook.errors.empty());
    return scene.tip();
  };
  const double blown = tip(false, false, false);
  CHECK(blown > 0.01);
  CHECK_NEAR(tip(true, false, false), blown, 1e-5);  // floats of 4
  CHECK_NEAR(tip(true, true, false), blown, 1e-5);
  CHECK(tip(true, false, true) < 0.5 * blown);
  Scene none;
  none.cook.set_text("windattrib", "none");
  none.at(1);
  CHECK(none.cook.errors.size() == 1 && contains(none.cook.errors[0], "there is no point attribute none of three numbers"));
}

// An attribute in the geometry's axes: turned upside down with it, the force still acts from the same side of the strip.
void an_attribute_of_points_is_a_force() {
  Scene up, turned, none;
  for (Scene *scene : {&up, &turned}) {
    std::vector<double> &force = scene->geometry().attributes["push"];
    for (int i = 0; i < STRIP_VERTICES; ++i) force.insert(force.end(), {0, 1e-3, 0});
    scene->cook.set("gravity", {0, 0, 0});
    scene->cook.set_text("force", "push");
  }
  turned.cook.set("framer", {180, 0, 0});
  const Points plain = up.play(8), other = turned.play(8);
  CHECK(up.tip() > 0.01 && up.cook.errors.empty());
  for (std::size_t i = 0; i < plain.size(); ++i) CHECK_NEAR(other[i].y(), plain[i].y(), 1e-5);  // floats of 4
  none.cook.set_text("force", "none");
  none.at(1);
  CHECK(none.cook.errors.size() == 1 && contains(none.cook.errors[0], "there is no point attribute none of three numbers"));
}

// Let go, a led point falls as one that was never led; held along y alone, it goes along x as the shell does.
void a_handle_lets_go_and_holds_along_axes() {
  Scene held, let_go, free_one, along;
  for (int frame = 1; frame <= 8; ++frame) {
    for (Scene *scene : {&held, &let_go, &along}) scene->lead(kTip, UT_Vector3(3.5f, 0.3f, 0));
    let_go.handles.fake_geometry().attributes["held"] = {0};
    along.handles.fake_geometry().attributes["axes"] = {SW_AXIS_Y};
    for (Scene *scene : {&held, &let_go, &free_one, &along}) scene->at(frame);
  }
  const auto tip = [](Scene &scene) { return scene.cook.output.fake_geometry().points[kTip]; };
  CHECK(same(let_go.cook.output.fake_geometry().points, free_one.cook.output.fake_geometry().points));
  CHECK_NEAR(tip(held).x(), 3.5, 1e-3);
  CHECK_NEAR(tip(along).y(), 0.3, 1e-3);
  CHECK(tip(along).x() > 3.6);
}

// -------------------------------------------------------------------------------------------------------------- errors

void expect_error(const std::function<void(Scene &)> &spoil, const char *part) {
  Scene scene;
  spoil(scene);
  scene.at(2);
  CHECK(scene.cook.errors.size() == 1 && same(scene.cook.output.fake_geometry().points, scene.geometry().points));
  if (scene.cook.errors.empty()) return;
  CHECK(contains(scene.cook.errors[0], part));
  if (!contains(scene.cook.errors[0], part)) printf("   message: '%s'\n", scene.cook.errors[0].c_str());
}

void what_a_user_can_mend_is_named_and_the_mesh_passes_through() {
  expect_error([](Scene &s) { s.cook.set_text("supportgroup", "none"); }, "there are no points of the group none");
  expect_error([](Scene &s) { s.cook.set_text("supportattrib", "none"); }, "there is no point attribute none");
  expect_error([](Scene &s) { s.cook.set_text("weightattrib", "none"); }, "there is no point attribute none");
  expect_error([](Scene &s) { s.geometry().primitives[4].closed = false; }, "primitive 4 is no closed polygon");
  expect_error([](Scene &s) { s.geometry().primitives[4].type = GEO_PRIMSPHERE; }, "primitive 4 is no closed polygon");
  expect_error([](Scene &s) { s.geometry().points[7] = UT_Vector3(NAN, 0, 0); }, "vertex 7");
  expect_error([](Scene &s) { s.geometry().primitives.clear(); }, "there is no surface");
  expect_error([](Scene &s) { s.cook.set("dampingratio", {-1}); }, "damping ratio is -1");
  expect_error([](Scene &s) { s.cook.set("framerate", {0}); }, "frame rate is 0");
  expect_error([](Scene &s) { s.cook.set("modes", {0}); }, "number of modes is 0");
  expect_error([](Scene &s) { s.cook.set_text("method", "linear"); }, "there is no method 'linear'; there are warp, ");
  expect_error([](Scene &s) { s.cook.set_text("method", "reduced-shell"), s.cook.set_text("supportgroup", ""); },
               "needs modes that bend it");
  expect_error([](Scene &s) { s.cook.set("stiffnessfrom", {2}), s.cook.set_text("preset", "silk"); },
               "there is no known material 'silk'; there are denim, ");
  expect_error([](Scene &s) { s.cook.set("stiffnessfrom", {3}); }, "the thickness of a sheet is 0");
  expect_error([](Scene &s) { s.put_box(-1), s.solid.fake_geometry().primitives.pop_back(); }, "the collider: ");
  expect_error([](Scene &s) { s.put_box(-1), s.solid.fake_geometry().primitives[2].closed = false; },
               "the collider: primitive 2 is no closed polygon");
  expect_error([](Scene &s) { s.lead(5000, UT_Vector3()); }, "holds vertex 5000");
  expect_error([](Scene &s) { s.lead(-1, UT_Vector3()); }, "negative point");
  expect_error([](Scene &s) { s.lead(3, UT_Vector3()), s.handles.fake_geometry().attributes.clear(); },
               "need i@shellpoint");
  expect_error([](Scene &s) { s.lead(3, UT_Vector3()), s.handles.fake_geometry().attributes["orient"] = {0, 0, 0, 0}; },
               "an orientation has length 0");
}

void after_an_error_is_mended_the_node_cooks() {
  Scene scene;
  scene.cook.set_text("supportgroup", "none");
  scene.at(1);
  scene.cook.set_text("supportgroup", "held");
  scene.play(10);
  CHECK(scene.cook.errors.empty() && scene.tip() < 0);
}

void a_shell_out_of_range_is_warned_of() {
  Scene scene;
  scene.lead(kTip, UT_Vector3());
  auto &attributes = scene.handles.fake_geometry().attributes;
  attributes["holdposition"] = {0};
  attributes["holdorientation"] = {1};
  attributes["orient"] = {0, 0, std::sin(1.0472), std::cos(1.0472)};  // turns the free end by a third of a circle
  scene.play(3);
  CHECK(scene.cook.errors.empty() && scene.cook.warnings.size() == 1);
  if (!scene.cook.warnings.empty()) CHECK(contains(scene.cook.warnings[0], "% of it beyond the quarter turn"));
}

void certify_tells_how_far_off_the_frame_is() {
  Scene scene;
  scene.play(5);
  CHECK(scene.cook.warnings.empty());
  scene.cook.set("certify", {1});
  scene.at(5);
  CHECK(scene.cook.errors.empty() && scene.cook.warnings.size() == 1);
  if (!scene.cook.warnings.empty()) CHECK(contains(scene.cook.warnings[0], "% off the full nonlinear shell"));
}

void escape_stops_the_precompute() {
  Scene scene;
  fake::interrupts().at = 3;
  scene.at(1);
  CHECK(!scene.cook.errors.empty() && contains(scene.cook.errors[0], "stopped by the user"));
  CHECK(fake::interrupts().polls == 3 && fake::interrupts().open == 0);
  scene.at(2);
  CHECK(scene.cook.errors.empty());
}

void the_box_says_which_phase_it_is_and_how_far() {
  Scene scene;
  scene.cook.set_text("method", "reduced-shell");
  scene.cook.set("reducedfields", {6});
  scene.at(1);
  int first = 101, last = -1;
  bool modes = false;
  for (const auto &[name, percent] : fake::interrupts().shown) {
    modes |= name == "Shell Warp: modes";
    if (name != "Shell Warp: training") continue;
    first = std::min(first, percent), last = std::max(last, percent);
  }
  CHECK(modes && first < 20 && last > 80 && last <= 100 && fake::interrupts().open == 0);
  // Esc while it trains.
  Scene stopped;
  stopped.cook.set_text("method", "reduced-shell");
  stopped.cook.set("reducedfields", {6});
  std::size_t poll = 0;
  stopped.at(1);
  const auto shown = fake::interrupts().shown;
  while (shown[poll].first != "Shell Warp: training") ++poll;
  stopped.cook.set("modes", {7});
  fake::interrupts() = {};
  fake::interrupts().at = int(poll) + 2;
  stopped.at(1);
  CHECK(stopped.cook.errors.size() == 1 && contains(stopped.cook.errors[0], "stopped by the user"));
}

// As polygons, or as the triangles that are right.
GU_Detail concave_detail(bool polygons) {
  const ConcaveSheet sheet;
  GU_Detail detail;
  fake::Geometry &geometry = detail.fake_geometry();
  for (const auto &p : sheet.points) geometry.points.emplace_back(float(p[0]), 0.0f, float(p[1]));
  for (const auto &corners : sheet.polygons)
    if (polygons) add_polygon(geometry, {corners.begin(), corners.end()});
  for (const auto &corners : sheet.triangles)
    if (!polygons) add_polygon(geometry, {corners.begin(), corners.end()});
  geometry.group("held", {0, 1, 2});
  return detail;
}

void concave_polygons_are_cut_inside() {
  Scene cut, right;
  cut.mesh = concave_detail(true);
  right.mesh = concave_detail(false);
  const Points a = cut.play(7), b = right.play(7);
  CHECK(cut.cook.errors.empty() && b[ConcaveSheet::far_corner].y() < -0.05f);
  for (std::size_t i = 0; i < b.size(); ++i) CHECK_NEAR(a[i].y(), b[i].y(), 1e-5);  // the basis in floats of 8
}

void quads_and_changed_topology_are_taken() {
  Scene scene;
  scene.play(5);
  fake::Geometry &geometry = scene.geometry();
  geometry = {};
  for (int i = 0; i < 21; ++i)
    for (int j = 0; j < 3; ++j) geometry.points.emplace_back(0.2f * float(i), 0.0f, 0.1f * float(j));
  for (int i = 0; i < 20; ++i)
    for (int j = 0; j < 2; ++j) add_polygon(geometry, {3 * i + j, 3 * i + j + 1, 3 * i + j + 4, 3 * i + j + 3});
  geometry.group("held", {0, 1, 2});
  const Points points = scene.play(12);
  CHECK(scene.cook.errors.empty() && points.size() == 63 && points[62].y() < -0.01f);
}

// ------------------------------------------------------------------------------------------------------------- picture

void write_obj(const std::string &path, const fake::Geometry &geometry) {
  std::ofstream file(path);
  for (const UT_Vector3 &p : geometry.points) file << "v " << p.x() << ' ' << p.y() << ' ' << p.z() << '\n';
  for (const GEO_PrimPoly &polygon : geometry.primitives) {
    file << 'f';
    for (const GA_Index i : polygon.points) file << ' ' << i + 1;
    file << '\n';
  }
}

// docs/guide/houdini.md, the first scene: a banner of 1.6 by 1 that hangs from its upper edge, the middle of its lower edge led out of
// its plane by a point.
GU_Detail banner(int columns, int rows) {
  GU_Detail detail;
  fake::Geometry &geometry = detail.fake_geometry();
  std::vector<int> top;
  for (int j = 0; j <= rows; ++j)
    for (int i = 0; i <= columns; ++i) {
      geometry.points.emplace_back(1.6f * float(i) / float(columns) - 0.8f, 1.0f * float(j) / float(rows), 0.0f);
      if (j == rows) top.push_back(int(geometry.points.size()) - 1);
    }
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i) {
      const int a = (columns + 1) * j + i, b = a + columns + 1;
      add_polygon(geometry, (i + j) % 2 ? std::vector<GA_Index>{a, a + 1, b} : std::vector<GA_Index>{a, a + 1, b + 1});
      add_polygon(geometry, (i + j) % 2 ? std::vector<GA_Index>{a + 1, b + 1, b} : std::vector<GA_Index>{a, b + 1, b});
    }
  geometry.group("top", top);
  return detail;
}

void the_first_scene_of_the_documentation_works(const char *folder) {
  std::unique_ptr<SOP_Node> node = plugin->create();
  fake::Cook &cook = node->fake_cook();
  const GU_Detail sheet = banner(32, 20);
  GU_Detail handles;
  cook.inputs[0] = &sheet;
  cook.inputs[1] = &handles;
  cook.set_text("supportgroup", "top");
  handles.fake_geometry().attributes["shellpoint"] = {16};
  for (int frame = 1; frame <= 48; ++frame) {
    const float pull = 0.4f * float(std::min(frame, 24) - 1) / 23;
    handles.fake_geometry().points = {UT_Vector3(0, 0.6f * pull * pull, pull)};
    OP_Context context((frame - 1) / 24.0);
    node->fake_run(context);
    CHECK(cook.errors.empty() && cook.warnings.empty());
    if (!cook.warnings.empty()) printf("   %d %s\n", frame, cook.warnings[0].c_str());
    if (folder && (frame == 1 || frame == 12 || frame == 24 || frame == 48))
      write_obj(std::string(folder) + "/banner_" + std::to_string(frame) + ".obj", cook.output.fake_geometry());
  }
  CHECK_NEAR(cook.output.fake_geometry().points[16].z(), 0.4,
             1e-5);  // met to a millionth of the size, and rounded to floats
}

}  // namespace

int main(int argc, char **argv) {
  if (argc < 3) return EXIT_FAILURE;
  try {
    const fake::Plugin loaded(argv[1]);
    plugin = &loaded;
    RUN(the_operator_takes_a_mesh_and_perhaps_handles);
    const auto the_documentation_is_complete = [&] { the_documentation_names_every_parameter(argv[2]); };
    RUN(the_documentation_is_complete);
    RUN(the_start_frame_shows_the_mesh_as_it_came_in);
    RUN(playing_moves_P_alone_and_says_so);
    RUN(scrubbing_repeats_playing_bit_for_bit);
    RUN(motion_blur_samples_do_not_disturb_the_frames);
    RUN(a_dropped_cache_changes_nothing);
    RUN(pieces_of_a_compiled_loop_keep_apart);
    RUN(a_jumped_frame_is_marked_as_not_simulated);
    RUN(the_cache_tells_its_memory);
    RUN(the_whole_input_leads_the_shell_as_its_rest_shape);
    RUN(held_points_of_the_input_lead_the_shell_or_are_told_of);
    RUN(velocities_are_those_of_the_positions);
    RUN(normals_of_vertices_are_those_of_the_bent_polygons);
    RUN(normals_of_points_are_those_of_the_bent_polygons);
    RUN(the_first_input_follows_what_is_simulated);
    RUN(the_menus_of_groups_and_attributes_are_houdinis);
    RUN(the_menu_of_methods_is_the_librarys_table);
    RUN(every_method_of_the_table_moves_the_polygons_or_is_told_of);
    RUN(every_parameter_changes_the_result);
    RUN(every_parameter_of_the_collider_changes_the_result);
    RUN(pieces_of_the_third_input_are_colliders_of_their_own);
    RUN(what_is_inside_a_collider_is_pushed_out_or_given_way_to);
    RUN(polygons_of_the_third_input_stop_the_strip_and_lift_it);
  RUN(an_open_ground_stops_the_strip_where_it_is_one_sided);
    RUN(the_menu_of_known_materials_is_the_librarys_table);
    RUN(a_known_material_is_the_sheet_of_its_numbers);
    RUN(a_map_multiplies_the_sheets_constant);
    RUN(a_map_multiplies_the_papers_constant);
    RUN(edges_of_a_group_fold);
    RUN(an_attribute_is_the_shape_without_stress);
    RUN(fibres_run_along_a_direction_or_an_attribute);
  RUN(maps_and_fibres_are_those_of_the_first_input_beside_a_fourth);
    RUN(points_are_held_along_axes);
    RUN(pieces_are_tied);
    RUN(a_moving_support_frame_shakes_the_shell);
    RUN(envelope_and_weights_scale_each_point);
    RUN(a_handle_point_leads_its_point);
    RUN(attributes_of_a_handle_point_are_read);
    RUN(wind_carries_a_known_material_by_its_own_weight);
    RUN(an_attribute_of_points_is_wind);
    RUN(an_attribute_of_points_is_a_force);
    RUN(a_handle_lets_go_and_holds_along_axes);
    RUN(what_a_user_can_mend_is_named_and_the_mesh_passes_through);
    RUN(after_an_error_is_mended_the_node_cooks);
    RUN(a_shell_out_of_range_is_warned_of);
    RUN(certify_tells_how_far_off_the_frame_is);
    RUN(escape_stops_the_precompute);
    RUN(the_box_says_which_phase_it_is_and_how_far);
    RUN(concave_polygons_are_cut_inside);
    RUN(quads_and_changed_topology_are_taken);
    const auto the_first_scene_works = [&] {
      the_first_scene_of_the_documentation_works(argc > 3 ? argv[3] : nullptr);
    };
    RUN(the_first_scene_works);
  } catch (const std::exception &error) {
    printf("%s\n", error.what());
    return EXIT_FAILURE;
  }
  return report_failures();
}
