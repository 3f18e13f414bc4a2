#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "bodyschema/core/error.hpp"
#include "bodyschema/robot/forward_kinematics.hpp"
#include "bodyschema/robot/robot_model.hpp"
#include "robot/robot_test_data.hpp"
#include "temporary_folder.hpp"
#include "robot/tiny_meshes.hpp"

namespace bodyschema {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

/// The message of the FileError that loading throws; one line, silent on the terminal.
class BadInput : public testing::Test {
 protected:
  std::string message(const RobotModelOptions& options) {
    testing::internal::CaptureStderr();
    testing::internal::CaptureStdout();
    std::string text = "nothing was thrown";
    try {
      RobotModel::load(options);
    } catch (const FileError& error) {
      text = error.what();
    }
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
    EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
    EXPECT_THAT(text, Not(HasSubstr("\n")));
    EXPECT_THAT(text, HasSubstr(options.urdf.filename().string()));
    return text;
  }
  std::string urdf_message(const std::string& text, const std::vector<std::string>& rendered = {}) {
    return message({folder_.write("bad.urdf", text), {}, rendered});
  }
  /// The error of one mesh file used by an otherwise good URDF.
  std::string mesh_message(const std::string& name, const std::string& content) {
    folder_.write(name, content);
    const auto urdf = folder_.write("good.urdf", one_part_urdf(mesh_visual(name)));
    try {
      RobotModel::load({urdf, {}, {"part"}});
    } catch (const FileError& error) {
      return error.what();
    }
    return "nothing was thrown";
  }
  static std::string joint(const std::string& name, const std::string& parent, const std::string& child,
                           const std::string& rest = "", const std::string& type = "fixed") {
    return "<joint name='" + name + "' type='" + type + "'><parent link='" + parent + "'/><child link='" + child +
           "'/>" + rest + "</joint>";
  }
  static std::string robot(const std::string& inside) { return "<robot name='r'>" + inside + "</robot>"; }
  static constexpr const char* kLimit = "<limit lower='-1' upper='1' effort='1' velocity='1'/>";
  TemporaryFolder folder_;
};

TEST_F(BadInput, UrdfThatIsNotThere) {
  EXPECT_THAT(message({folder_.path() / "none.urdf", {}, {}}), HasSubstr("URDF not found"));
}
TEST_F(BadInput, UrdfThatIsAFolder) {
  EXPECT_THAT(message({folder_.path(), {}, {}}), HasSubstr("not a regular file"));
}
TEST_F(BadInput, UrdfThatIsNotXml) {
  EXPECT_THAT(urdf_message("<robot name='r'><link name="), HasSubstr("not a usable URDF"));
  EXPECT_THAT(urdf_message(""), HasSubstr("not a usable URDF"));
  EXPECT_THAT(urdf_message("just text"), HasSubstr("not a usable URDF"));
  EXPECT_THAT(urdf_message(std::string("\0\1\2<\xff>", 6)), HasSubstr("not a usable URDF"));
}
TEST_F(BadInput, XmlThatIsNotAUrdf) {
  EXPECT_THAT(urdf_message("<html><body/></html>"), HasSubstr("robot"));
}
TEST_F(BadInput, UrdfWithoutLinks) {
  EXPECT_THAT(urdf_message(robot("")), HasSubstr("not a usable URDF"));
}
TEST_F(BadInput, UrdfThatNestsWithoutEnd) {
  std::string text = "<robot name='r'>";
  for (int i = 0; i < 200000; ++i) text += "<a>";
  EXPECT_THAT(urdf_message(text), HasSubstr("nest 200001 deep"));
}
// Parsers pass over an end without a start, which must not make room for more below.
TEST_F(BadInput, UrdfThatEndsMoreThanItBegins) {
  std::string text;
  for (int i = 0; i < 2000; ++i) text += "</x>";
  text += "<robot name='r'>";
  for (int i = 0; i < 2000; ++i) text += "<a>";
  EXPECT_THAT(urdf_message(text), HasSubstr("</x> ends an element that has not begun"));
}
// What hides ends from the parser but not from the guard before it.
TEST_F(BadInput, UrdfWhoseNestingIsHidden) {
  for (const std::string hidden : {"<!--></a>-->", "<?x ></a>?>", "<!x '></a>'>", "<![CDATA[></a>]]>"}) {
    SCOPED_TRACE(hidden);
    std::string text = "<robot name='r'>";
    for (int i = 0; i < 500; ++i) text += "<a>" + hidden;
    EXPECT_THAT(urdf_message(text), testing::AnyOf(HasSubstr("nest 501 deep"), HasSubstr("it declares")));
  }
}
// The same for what TinyXML in particular reads otherwise than it looks.
TEST_F(BadInput, UrdfThatTheParserReadsOtherwise) {
  for (const std::string hidden :
       {"<a><?xml version=\"?></a>\"?>", "<a><?XML version='?></a>'?>", "<a><?x y='?></a>'?>", "<1 '><a>'/>",
        "< '><a>'/>", "<a b=\"&#x\"></a>x41;\">", "<a>&#x</a>x41;", "<a>&#</a>#65;", "<a>\xC2</a>", "<a>\xE2\x82</a>",
        "<a b='\xF0'></a>'>"}) {
    SCOPED_TRACE(hidden);
    std::string text = "<?xml version='1.0'?><robot name='r'>";
    for (int i = 0; i < 60'000; ++i) text += hidden;
    EXPECT_THAT(urdf_message(text), testing::AnyOf(HasSubstr("expected"), HasSubstr("it declares")));
  }
  std::string nested;
  for (int i = 0; i < 60'000; ++i) nested += "<a>";
  for (const std::string begin : {"<?xml version='?><!--'?>", "<?xml x=\"a version=\"?><!--\"?>",
                                  "<?xml \" version=\"?><!--\"?>", "<?xml version='1.0'?><?xml version='?><!--'?>"}) {
    SCOPED_TRACE(begin);
    EXPECT_THAT(urdf_message(begin + "<robot name='r'>" + nested + "-->"), HasSubstr("it declares"));
  }
  // What is nothing of the kind stays allowed.
  for (const std::string begin :
       {"", "\xEF\xBB\xBF<?xml version=\"1.0\" ?>\n", "\n<?xml version = '1.0' encoding='utf-8' standalone=\"yes\"?>",
        "<?xml version='1.0' encoding='iso-8859-1'?><!-- Andr\xE9 said -->"}) {
    SCOPED_TRACE(begin);
    const std::string inside = "<link name='caf\xC3\xA9'/><!-- &#x20AC; a -> b, \xE2\x82\xAC -->";
    const auto good = folder_.write("good.urdf", begin + robot(inside));
    EXPECT_NO_THROW(RobotModel::load({good, {}, {}}));
  }
}
TEST_F(BadInput, UrdfThatDeclaresEntities) {
  std::string text = "<!DOCTYPE robot [<!ENTITY a0 'aaaaaaaaaa'>";
  for (int i = 1; i < 10; ++i) {
    text += "<!ENTITY a" + std::to_string(i) + " '";
    for (int k = 0; k < 10; ++k) text += "&a" + std::to_string(i - 1) + ";";
    text += "'>";
  }
  text += "]>" + robot("<link name='&a9;'/>");
  EXPECT_THAT(urdf_message(text), HasSubstr("declares a document type, entities or the like"));
  const auto good = folder_.write("good.urdf", "<?xml version='1.0'?><!-- a > b -->" + robot("<link name='a'/>"));
  EXPECT_NO_THROW(RobotModel::load({good, {}, {}}));
}
TEST_F(BadInput, UrdfOfMoreLinksThanARobotHas) {
  const auto chain = [](int links) {
    std::string inside = "<link name='l0'/>";
    for (int i = 1; i < links; ++i) {
      const std::string name = std::to_string(i), above = std::to_string(i - 1);
      inside +=
          "<link name='l" + name + "'/>" +
          joint("j" + name, "l" + above, "l" + name,
                "<axis xyz='1 0 0'/>" + (i > 1 ? "<mimic joint='j" + above + "'/>" : std::string()), "continuous");
    }
    return robot(inside);
  };
  EXPECT_THAT(urdf_message(chain(50'000)), HasSubstr("more than 2000 links, too many for a robot"));
  const auto model = RobotModel::load({folder_.write("long.urdf", chain(2000)), {}, {}});
  EXPECT_EQ(model->joint_count(), 1);
}
TEST_F(BadInput, UrdfThatIsTooLarge) {
  const auto file = folder_.write("large.urdf", "<robot/>");
  std::filesystem::resize_file(file, (16u << 20) + 1);
  EXPECT_THAT(message({file, {}, {}}), HasSubstr("at most 16777216"));
}
TEST_F(BadInput, NumbersThatAreNone) {
  EXPECT_THAT(
      urdf_message(robot("<link name='a'/><link name='b'/>" + joint("j", "a", "b", "<origin xyz='0 zero 0'/>"))),
      HasSubstr("not a usable URDF"));
  EXPECT_THAT(
      urdf_message(robot("<link name='a'/><link name='b'/>" + joint("j", "a", "b", "<origin xyz='0 1e999 0'/>"))),
      AllOf(HasSubstr("bad.urdf"), Not(HasSubstr("nothing was thrown"))));
}
TEST_F(BadInput, AxisOfNoLength) {
  EXPECT_THAT(urdf_message(robot("<link name='a'/><link name='b'/>" +
                                 joint("j", "a", "b", "<axis xyz='0 0 0'/>" + std::string(kLimit), "revolute"))),
              HasSubstr("joint 'j': axis is zero"));
}
TEST_F(BadInput, LimitsTheWrongWayRound) {
  EXPECT_THAT(urdf_message(robot("<link name='a'/><link name='b'/>" +
                                 joint("j", "a", "b",
                                       "<axis xyz='1 0 0'/><limit lower='2' upper='1' effort='1' "
                                       "velocity='1'/>",
                                       "revolute"))),
              HasSubstr("joint 'j': limits [2, 1]"));
}
TEST_F(BadInput, CycleThroughTheRoot) {
  EXPECT_THAT(urdf_message(robot("<link name='a'/><link name='b'/>" + joint("j", "a", "b") + joint("k", "b", "a"))),
              HasSubstr("link 'a' is its own ancestor"));
}
TEST_F(BadInput, CycleThatHangsOffTheRoot) {
  EXPECT_THAT(urdf_message(robot("<link name='a'/><link name='b'/><link name='c'/>" + joint("j", "a", "b") +
                                 joint("k", "b", "c") + joint("l", "c", "b"))),
              HasSubstr("link 'b' is the child of joints 'j' and 'l'"));
}
TEST_F(BadInput, CycleBesideTheRoot) {
  EXPECT_THAT(urdf_message(robot("<link name='a'/><link name='b'/><link name='c'/>" + joint("k", "b", "c") +
                                 joint("l", "c", "b"))),
              HasSubstr("link 'b' is its own ancestor"));
}
TEST_F(BadInput, TwoRoots) {
  EXPECT_THAT(urdf_message(robot("<link name='a'/><link name='b'/>")), HasSubstr("not a usable URDF"));
}
TEST_F(BadInput, JointToALinkThatIsNotThere) {
  EXPECT_THAT(urdf_message(robot("<link name='a'/>" + joint("j", "a", "b"))), HasSubstr("b"));
}
TEST_F(BadInput, MimicOfAnUnknownJoint) {
  EXPECT_THAT(urdf_message(robot(
                  "<link name='a'/><link name='b'/>" +
                  joint("elbow", "a", "b",
                        "<axis xyz='1 0 0'/>" + std::string(kLimit) + "<mimic joint='elbo' multiplier='1' offset='0'/>",
                        "revolute"))),
              AllOf(HasSubstr("mimics unknown joint 'elbo'"), HasSubstr("did you mean 'elbow'?")));
}
TEST_F(BadInput, MimicsThatChaseEachOther) {
  const std::string rest = "<axis xyz='1 0 0'/>" + std::string(kLimit);
  EXPECT_THAT(urdf_message(robot("<link name='a'/><link name='b'/><link name='c'/>" +
                                 joint("j", "a", "b", rest + "<mimic joint='k'/>", "revolute") +
                                 joint("k", "b", "c", rest + "<mimic joint='j'/>", "revolute"))),
              HasSubstr("its mimic chain is a cycle"));
}
TEST_F(BadInput, NegativeMass) {
  EXPECT_THAT(urdf_message(robot("<link name='a'><inertial><mass value='-1'/><inertia ixx='1' "
                                 "ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial></link>")),
              HasSubstr("link 'a': inertial"));
}
TEST_F(BadInput, RenderedLinkThatIsUnknown) {
  EXPECT_THAT(urdf_message(one_part_urdf(""), {"prt"}),
              AllOf(HasSubstr("no link 'prt' to render"), HasSubstr("did you mean 'part'?")));
}
TEST_F(BadInput, RenderedLinkWithoutShape) {
  EXPECT_THAT(urdf_message(one_part_urdf(""), {"part"}), HasSubstr("link 'part' is to be rendered"));
}
TEST_F(BadInput, RenderedLinkNamedTwice) {
  EXPECT_THAT(
      urdf_message(one_part_urdf("<visual><geometry><box size='1 1 1'/></geometry></visual>"), {"part", "part"}),
      HasSubstr("twice"));
}
TEST_F(BadInput, MeshThatIsNotThere) {
  EXPECT_THAT(urdf_message(one_part_urdf(mesh_visual("meshes/none.stl")), {"part"}),
              AllOf(HasSubstr("link 'part'"), HasSubstr("'meshes/none.stl' not found; tried ")));
}
TEST_F(BadInput, PackageWithoutSearchRoots) {
  EXPECT_THAT(urdf_message(one_part_urdf(mesh_visual("package://iCub/a.stl")), {"part"}),
              HasSubstr("mesh_search_roots"));
}
TEST_F(BadInput, PathsThatLeaveTheSearchRoots) {
  folder_.write("outside.obj", obj_text(test_box({0, 0, 0}, {1, 1, 1})));
  const auto root = folder_.path() / "root";
  std::filesystem::create_directories(root / "pkg");
  const std::vector<std::string> names = {"../outside.obj",
                                          "package://../outside.obj",
                                          "sub/../../outside.obj",
                                          "package://pkg/../../outside.obj",
                                          "model://pkg/../../outside.obj",
                                          (folder_.path() / "outside.obj").string(),
                                          "file://" + (folder_.path() / "outside.obj").string()};
  for (const auto& name : names) {
    SCOPED_TRACE(name);
    const auto urdf = folder_.write("root/bad.urdf", one_part_urdf(mesh_visual(name)));
    EXPECT_THAT(message({urdf, {root}, {"part"}}), HasSubstr("leads outside"));
  }
  // Symbolic links, of files and of folders, lead where they lead, whatever they are called.
  std::filesystem::create_symlink(folder_.path() / "outside.obj", root / "link.obj");
  std::filesystem::create_directory_symlink(folder_.path(), root / "up");
  for (const char* name : {"link.obj", "up/outside.obj", "package://up/outside.obj", "up/root/../outside.obj"}) {
    SCOPED_TRACE(name);
    const auto urdf = folder_.write("root/bad.urdf", one_part_urdf(mesh_visual(name)));
    EXPECT_THAT(message({urdf, {root}, {"part"}}), HasSubstr("leads outside"));
    EXPECT_NO_THROW(RobotModel::load({urdf, {root, folder_.path()}, {"part"}})) << "its target is a root";
  }
  // A root may itself be a link.
  std::filesystem::create_directory_symlink(root, folder_.path() / "linked_root");
  folder_.write("root/inside.obj", obj_text(test_box({0, 0, 0}, {1, 1, 1})));
  const auto urdf = folder_.write("good.urdf", one_part_urdf(mesh_visual("package://inside.obj")));
  EXPECT_NO_THROW(RobotModel::load({urdf, {folder_.path() / "linked_root"}, {"part"}}));
}
TEST_F(BadInput, ScaleOfZero) {
  folder_.write("a.obj", obj_text(test_box({0, 0, 0}, {1, 1, 1})));
  EXPECT_THAT(urdf_message(one_part_urdf(mesh_visual("a.obj", "1 0 1")), {"part"}),
              HasSubstr("scale must be finite and not zero"));
}
TEST_F(BadInput, ScaleBeyondAllMeasure) {
  folder_.write("a.obj", obj_text(test_box({0, 0, 0}, {1, 1, 1})));
  for (const char* scale : {"1e40 1 1", "1e7 1 1", "1 1 -1e7"}) {
    SCOPED_TRACE(scale);
    EXPECT_THAT(urdf_message(one_part_urdf(mesh_visual("a.obj", scale)), {"part"}),
                AllOf(HasSubstr("link 'part'"), HasSubstr("reaches further than 1e6 m")));
  }
  const std::string far = "<visual><origin xyz='0 1e30 0'/><geometry><box size='1 1 1'/></geometry></visual>";
  EXPECT_THAT(urdf_message(one_part_urdf(far), {"part"}), HasSubstr("reaches further than 1e6 m"));
}
TEST_F(BadInput, MoreTrianglesThanARobotHas) {
  std::string visuals;
  for (int i = 0; i < 40'000; ++i) visuals += "<visual><geometry><sphere radius='1'/></geometry></visual>";
  EXPECT_THAT(urdf_message(one_part_urdf(visuals), {"part"}), HasSubstr("more than 4000000 triangles together"));
}
TEST_F(BadInput, PrimitiveOfNoSize) {
  EXPECT_THAT(urdf_message(one_part_urdf("<visual><geometry><sphere radius='-1'/></geometry></visual>"), {"part"}),
              HasSubstr("sphere radius must be positive"));
}
TEST_F(BadInput, MeshesThatCannotBeRead) {
  const std::string good = binary_stl(test_box({0, 0, 0}, {1, 1, 1}));
  const std::vector<std::pair<std::string, std::string>> broken = {
      {"empty.obj", ""},
      {"empty.stl", ""},
      {"empty.dae", ""},
      {"no_faces.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n"},
      {"noise.stl", std::string(300, '\x7f')},
      {"cut.stl", good.substr(0, good.size() / 2)},
      {"noise.dae", "<COLLADA><oops"},
      {"no_scene.dae", "<COLLADA xmlns='x' version='1.4.1'><asset/></COLLADA>"},
      {"wrong_index.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 999999999\n"},
      {"flat.obj", "v 0 0 0\nv 0 0 0\nv 0 0 0\nf 1 2 3\n"},
      {"not_finite.obj", "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"},
      {"unknown.ply", "ply\n"},
  };
  for (const auto& [name, content] : broken) {
    SCOPED_TRACE(name);
    const std::string text = mesh_message(name, content);
    EXPECT_THAT(text, HasSubstr(name));
    EXPECT_THAT(text, Not(HasSubstr("\n")));
  }
}
TEST_F(BadInput, StlThatClaimsFourBillionTriangles) {
  std::string text = binary_stl(test_box({0, 0, 0}, {1, 1, 1}));
  const std::uint32_t claim = 0xfffffff0u;
  std::memcpy(text.data() + 80, &claim, 4);
  EXPECT_THAT(mesh_message("claim.stl", text), HasSubstr("claim.stl"));
}
TEST_F(BadInput, ColladaThatNestsOrUnfoldsWithoutEnd) {
  const std::string good = dae_text(test_box({0, 0, 0}, {1, 1, 1}), "1", "Z_UP", "", "");
  const auto spoilt = [&](const std::string& nodes, const std::string& library = "") {
    std::string text = good;
    const std::string scenes = "<library_visual_scenes>";
    text.insert(text.find("<node id=\"outer\">"), nodes);
    text.insert(text.find(scenes), library);
    return text;
  };
  EXPECT_THAT(mesh_message("good.dae", spoilt("<node id='n'/>")), "nothing was thrown");
  EXPECT_THAT(mesh_message("deep.dae", spoilt([] {
                             std::string open, close;
                             for (int i = 0; i < 100000; ++i) {
                               open += "<node>";
                               close += "</node>";
                             }
                             return open + close;
                           }())),
              AllOf(HasSubstr("deep.dae"), HasSubstr("deep, at most 100")));
  std::string hidden;
  for (int i = 0; i < 3000; ++i) hidden += "<node><!--></node>-->";
  for (int i = 0; i < 3000; ++i) hidden += "</node>";
  EXPECT_THAT(mesh_message("hidden.dae", spoilt(hidden)), HasSubstr("deep, at most 100"));
  std::string ends;
  for (int i = 0; i < 3000; ++i) ends += "</x>";
  EXPECT_THAT(mesh_message("ends.dae", ends + good), HasSubstr("ends an element that has not begun"));
  EXPECT_THAT(mesh_message("self.dae", spoilt("<node id='n'><instance_node url='#n'/></node>")), HasSubstr("cycle"));
  std::string library = "<library_nodes>";
  for (int i = 0; i < 9; ++i) {
    library += "<node id='n" + std::to_string(i) + "'>";
    for (int k = 0; k < 10; ++k) library += "<instance_node url=\"#n" + std::to_string(i + 1) + "\"/>";
    library += "</node>";
  }
  library += "<node id='n9'/></library_nodes>";
  EXPECT_THAT(mesh_message("laughs.dae", spoilt("<node><instance_node url='#n0'/></node>", library)),
              HasSubstr("unfold to more than 100000"));
  std::string chain = "<library_nodes>";
  for (int i = 0; i < 50000; ++i) {
    chain += "<node id='c" + std::to_string(i) + "'><instance_node url='#c" + std::to_string(i + 1) + "'/></node>";
  }
  chain += "</library_nodes>";
  EXPECT_THAT(mesh_message("chain.dae", spoilt("<node><instance_node url='#c0'/></node>", chain)),
              HasSubstr("nest more than 100 deep"));
}
TEST_F(BadInput, ColladaWhoseIndicesAreNotNumbers) {
  const std::string good = dae_text(test_box({0, 0, 0}, {1, 1, 1}), "1", "Z_UP", "", "");
  ASSERT_THAT(mesh_message("good.dae", good), "nothing was thrown");
  for (const char* inserted : {"x ", "- ", "1-2 ", "1.5 ", "&#49; ", "<![CDATA[-]]>"}) {
    SCOPED_TRACE(inserted);
    std::string text = good;
    text.insert(text.find("<p>") + 3, inserted);
    EXPECT_THAT(mesh_message("indices.dae", text), HasSubstr("its <p> holds something that is not"));
  }
}
TEST_F(BadInput, ColladaArraysShorterThanTheirAccessor) {
  const std::string good = dae_text(test_box({0, 0, 0}, {1, 1, 1}), "1", "Z_UP", "", "");
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  };
  for (const auto& [from, to] : std::vector<std::pair<std::string, std::string>>{
           {"id=\"pa\" count=\"24\"", "id=\"pa\""},
           {"id=\"pa\" count=\"24\"", "id=\"pa\" count=\"23\""},
           {"id=\"pa\" count=\"24\"", "id=\"pa\" count=\"-1\""},
           {"id=\"pa\" count=\"24\"", "id=\"pb\" count=\"24\""},
           {"count=\"8\" stride=\"3\"", "count=\"900000000\" stride=\"3\""},
           {"count=\"8\" stride=\"3\"", "count=\"8\" stride=\"999999999\""},
           {"count=\"8\" stride=\"3\"", "count=\"8\" stride=\"3\" offset=\"1\""}}) {
    SCOPED_TRACE(to);
    EXPECT_THAT(mesh_message("short.dae", with(from, to)), HasSubstr("short.dae: mesh cannot be read"));
  }
}
TEST_F(BadInput, UnknownNamesNameTheNearest) {
  const auto urdf = folder_.write("good.urdf", one_part_urdf(""));
  const auto model = RobotModel::load({urdf, {}, {}});
  const auto text_of = [](const std::function<void()>& action) {
    try {
      action();
    } catch (const ConfigurationError& error) {
      return std::string(error.what());
    }
    return std::string("nothing was thrown");
  };
  EXPECT_THAT(text_of([&] { ForwardKinematics(model, {"prt"}); }), HasSubstr("did you mean 'part'?"));
  EXPECT_THAT(text_of([&] { (void)model->joint_index("jj"); }), HasSubstr("did you mean 'j'?"));
  EXPECT_FALSE(model->find_joint("jj").has_value());
}

TEST(RobotSetupErrors, NamesAreCheckedAgainstTheRobot) {
  const auto text_of = [](const std::function<void(RobotSetup&)>& spoil) {
    RobotSetup setup = robot_setup("icub_right/robot.yaml");
    setup.model.rendered_links.clear();
    spoil(setup);
    try {
      (void)setup.load();
    } catch (const ConfigurationError& error) {
      return std::string(error.what());
    }
    return std::string("nothing was thrown");
  };
  EXPECT_EQ(text_of([](RobotSetup&) {}), "nothing was thrown");
  EXPECT_THAT(text_of([](RobotSetup& s) { s.hand_link = "r_hnd"; }),
              AllOf(testing::StartsWith(BODYSCHEMA_SOURCE_DIR "/config/icub_right/robot.yaml:"),
                    testing::EndsWith(
                        ": key 'robot.hand_link': 'r_hnd' is not in robot 'icub_right'; did you mean 'r_hand'?")));
  EXPECT_THAT(text_of([](RobotSetup& s) { s.estimated_joints[0] = "r_elbo"; }),
              AllOf(HasSubstr("robot.estimated_joints"), HasSubstr("'r_elbow'")));
  EXPECT_THAT(text_of([](RobotSetup& s) { s.head_joints[0] = "x"; }), HasSubstr("robot.head_joints"));
  EXPECT_THAT(text_of([](RobotSetup& s) { s.fingertip_links[0] = "x"; }), HasSubstr("robot.fingertip_links"));
  EXPECT_THAT(text_of([](RobotSetup& s) { s.fixed_joints_rad["x"] = 0; }), HasSubstr("robot.fixed_joints_deg"));
}

TEST(RobotSetupErrors, NameFileAndLineOfTheWrongName) {
  TemporaryFolder folder;
  (void)folder.write("r.urdf",
                     "<robot name='r'><link name='base'/><link name='hand'/>"
                     "<joint name='turn' type='revolute'><parent link='base'/><child link='hand'/>"
                     "<axis xyz='0 0 1'/><limit lower='-1' upper='1' effort='1' velocity='1'/></joint>"
                     "</robot>");
  const std::vector<std::string> good = {"urdf: r.urdf", "rendered_links: [hand]", "hand_link: hand",
                                         "estimated_joints: [turn]"};
  const auto text_of = [&](std::size_t line, const std::string& wrong) {
    auto lines = good;
    lines.resize(std::max(lines.size(), line + 1));
    lines[line] = wrong;
    std::string text = "robot:\n";
    for (const auto& one : lines) text += "  " + one + '\n';
    auto setup = RobotSetup::from(Configuration::load(folder.write("r.yaml", text)).section("robot"));
    setup.model.rendered_links.clear();
    try {
      (void)setup.load();
    } catch (const ConfigurationError& error) {
      return std::string(error.what());
    }
    return std::string("nothing was thrown");
  };
  EXPECT_EQ(text_of(2, good[2]), "nothing was thrown");
  EXPECT_THAT(text_of(2, "hand_link: hnd"), HasSubstr("r.yaml:4: key 'robot.hand_link': 'hnd' is not in robot 'r'"));
  EXPECT_THAT(text_of(3, "estimated_joints: [trn]"), HasSubstr("r.yaml:5: key 'robot.estimated_joints': 'trn' is"));
  EXPECT_THAT(text_of(4, "head_joints: [trn]"), HasSubstr("r.yaml:6: key 'robot.head_joints': 'trn' is"));
  EXPECT_THAT(text_of(4, "fingertip_links: [tip]"), HasSubstr("r.yaml:6: key 'robot.fingertip_links': 'tip' is"));
  EXPECT_THAT(text_of(4, "fixed_joints_deg: {trn: 1}"),
              HasSubstr("r.yaml:6: key 'robot.fixed_joints_deg.trn': 'trn' is"));
  EXPECT_THAT(text_of(4, "fixed_joints_m: {turn: 1}"),
              HasSubstr("r.yaml:6: key 'robot.fixed_joints_m.turn': 'turn' turns; give it under"));
}

TEST(RobotSetupErrors, JointsThatSlideAreFixedInMetresAndNeverEstimated) {
  TemporaryFolder folder;
  const auto joint = [](const char* name, const char* type, const char* from, const char* to) {
    return std::string("<joint name='") + name + "' type='" + type + "'><parent link='" + from + "'/><child link='" +
           to + "'/><axis xyz='0 0 1'/><limit lower='-1' upper='1' effort='1' velocity='1'/></joint>";
  };
  RobotSetup setup;
  setup.model.urdf =
      folder.write("slide.urdf", "<robot name='slide'><link name='base'/><link name='cart'/><link name='hand'/>" +
                                     joint("lift", "prismatic", "base", "cart") +
                                     joint("turn", "revolute", "cart", "hand") + "</robot>");
  setup.hand_link = "hand";
  setup.estimated_joints = {"turn"};
  setup.fixed_joints_m["lift"] = 0.25;
  const auto robot = setup.load();
  EXPECT_EQ(setup.default_joints(*robot)[robot->joint_index("lift")], 0.25);
  const auto refused = [&](const RobotSetup& wrong, const char* why) {
    EXPECT_THAT([&] { (void)wrong.load(); }, testing::ThrowsMessage<ConfigurationError>(HasSubstr(why)));
  };
  auto in_degrees = setup;
  in_degrees.fixed_joints_rad["lift"] = 0.1;
  refused(in_degrees, "robot.fixed_joints_deg: 'lift' slides; give it under robot.fixed_joints_m");
  auto in_metres = setup;
  in_metres.fixed_joints_m["turn"] = 0.1;
  refused(in_metres, "robot.fixed_joints_m: 'turn' turns; give it under robot.fixed_joints_deg");
  auto estimated = setup;
  estimated.estimated_joints = {"turn", "lift"};
  refused(estimated, "robot.estimated_joints: 'lift' slides");
  auto head = setup;
  head.head_joints = {"lift"};
  refused(head, "robot.head_joints: 'lift' slides; expected joints that turn");
}

TEST(RobotSetupErrors, ValuesAreChecked) {
  const auto text_of = [](const std::string& yaml) {
    try {
      RobotSetup::from(Configuration::parse(yaml).section("robot"));
    } catch (const ConfigurationError& error) {
      return std::string(error.what());
    }
    return std::string("nothing was thrown");
  };
  const std::string good = "robot:\n  urdf: a.urdf\n  rendered_links: [a]\n  hand_link: a\n  estimated_joints: [j]\n";
  EXPECT_EQ(text_of(good), "nothing was thrown");
  EXPECT_THAT(text_of(good + "  gravity_m_s2: [0, 1]\n"), HasSubstr("gravity_m_s2"));
  EXPECT_THAT(text_of(good + "  face_culling: front\n"), HasSubstr("face_culling"));
  EXPECT_THAT(text_of(good + "  fixed_joints_deg: {j: x}\n"), HasSubstr("fixed_joints_deg"));
  EXPECT_THAT(text_of(good + "  fixed_joints_m: {j: 1000}\n"), HasSubstr("fixed_joints_m"));
  EXPECT_THAT(text_of("robot:\n  urdf: a.urdf\n  rendered_links: []\n  hand_link: a\n"
                      "  estimated_joints: [j]\n"),
              HasSubstr("rendered_links"));
  EXPECT_THAT(text_of("robot:\n  urdf: a.urdf\n  rendered_links: [a]\n  hand_link: a\n"
                      "  estimated_joints: [j, j]\n"),
              HasSubstr("estimated_joints"));
}

}  // namespace
}  // namespace bodyschema
