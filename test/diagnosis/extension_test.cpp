#include "extension.hpp"

#include <gtest/gtest.h>

#include "effects/roles.hpp"

namespace bodyschema::diagnosis {
namespace {

/// A selection whose causes were fitted: what drop_weakest looks at, and nothing else.
struct Fitted {
  ErrorModel model{test::roles()};
  CandidateSet set;
  Selection selection;
  ModelFit after;
  SelectionOptions rules;
  std::size_t blocks = rules.usual_blocks;

  std::size_t add_candidate(const std::string& name, const EffectTarget& target, bool nuisance = false) {
    Candidate candidate;
    candidate.name = name;
    candidate.target = target;
    candidate.slip = name == "slip";
    candidate.nuisance = nuisance;
    if (!candidate.slip) candidate.parameters = {0};
    set.candidates.push_back(candidate);
    return set.candidates.size() - 1;
  }

  /// A cause that the model holds, at so many standard errors.
  void add_cause(std::size_t candidate, double z, double gain, std::vector<std::size_t> same = {}) {
    SelectedCause cause{.candidate = candidate, .score = {z, gain, 0.0, true}};
    cause.gain_judged = gain;
    cause.same = std::move(same);
    selection.causes.push_back(std::move(cause));
    auto& effect = model.add(set.candidates[candidate].name, set.candidates[candidate].target);
    effect.parameters()[0].value = z * effect.parameters()[0].typical;
    refit();
  }

  /// Standard errors of the parameters' typical sizes.
  void refit() {
    after.parameters.clear();
    for (std::size_t e = 0; e < model.size(); ++e) after.parameters.push_back({e, 0});
    const auto n = static_cast<Eigen::Index>(after.parameters.size());
    after.fit.covariance = Eigen::MatrixXd::Identity(n, n);
    after.fit.usable = true;
    after.statistics.emplace(std::vector<BlockStatistics::Block>(blocks, {{}, {}, 1.0, 1.0, {}}));
  }

  bool drop() { return drop_weakest(selection, set, after, rules, model); }
};

TEST(DropWeakest, TakesOneAfterAnotherOutOfSelectionAndModel) {
  Fitted fitted;
  fitted.add_cause(fitted.add_candidate("backlash", {"elbow", ""}), 4.0, 0.1);
  fitted.add_cause(fitted.add_candidate("latency", {}), 3.0, 0.1);
  fitted.add_cause(fitted.add_candidate("compliance", {"elbow", ""}), 5.0, 0.1);
  ASSERT_TRUE(fitted.drop());
  EXPECT_EQ(fitted.model.find("latency", {}), nullptr);
  fitted.refit();
  ASSERT_TRUE(fitted.drop());
  EXPECT_EQ(fitted.model.find("backlash", {"elbow", ""}), nullptr);
  fitted.refit();
  EXPECT_FALSE(fitted.drop());
  ASSERT_EQ(fitted.selection.causes.size(), 1u);
  EXPECT_EQ(fitted.selection.causes[0].candidate, 2u);
}

/// What takes away that much is there, even if its shape fits badly; but only a cause in time is excused.
TEST(DropWeakest, AsksLessOfACauseInTimeThatTakesAwayMuch) {
  const auto stays = [](const std::string& name, double z, double gain) {
    Fitted fitted;
    fitted.add_cause(fitted.add_candidate(name, {"elbow", ""}), z, gain);
    return !fitted.drop();
  };
  for (const char* in_time : {"drift", "slip"}) {
    EXPECT_TRUE(stays(in_time, 3.6, 0.3)) << in_time;
    EXPECT_FALSE(stays(in_time, 2.9, 0.3)) << in_time;
    EXPECT_FALSE(stays(in_time, 3.6, 0.2)) << in_time;
  }
  EXPECT_FALSE(stays("encoder_gain", 3.6, 0.3));
  EXPECT_TRUE(stays("encoder_gain", 4.6, 0.3));
}

/// Standard errors of ten blocks are known worse, before the fit and after it.
TEST(DropWeakest, AsksMoreWhereBlocksAreFew) {
  for (const auto& [blocks, z, stays] :
       {std::tuple{30, 4.6, true}, std::tuple{10, 4.6, false}, std::tuple{10, 7.0, true}}) {
    Fitted fitted;
    fitted.blocks = static_cast<std::size_t>(blocks);
    fitted.add_cause(fitted.add_candidate("latency", {}), z, 0.1);
    EXPECT_EQ(!fitted.drop(), stays) << blocks << " blocks, z " << z;
  }
}

/// As the selection asked: later a nuisance that is a cause too makes every share smaller.
TEST(DropWeakest, AsksByTheShareThatTheCauseEnteredWith) {
  Fitted fitted;
  fitted.add_cause(fitted.add_candidate("drift", {"elbow", ""}), 3.6, 0.3);
  fitted.selection.causes[0].score.gain = 0.2;
  EXPECT_FALSE(fitted.drop());
}

TEST(DropWeakest, DropsACauseThatIsNotInTheModel) {
  Fitted fitted;
  const auto slip = fitted.add_candidate("slip", {"elbow", ""});
  fitted.add_cause(slip, 9.0, 0.5);
  fitted.model.remove("slip", {"elbow", ""});
  fitted.refit();
  EXPECT_TRUE(fitted.drop());
  EXPECT_TRUE(fitted.selection.causes.empty());
}

TEST(DropWeakest, PutsBackTheNuisanceThatTheCauseStoodFor) {
  Fitted fitted;
  const auto vergence = fitted.add_candidate("vergence", {}, true);
  const auto focal = fitted.add_candidate("focal_length", {}, true);
  const auto unseen = fitted.add_candidate("mesh_scale", {}, true);
  const auto baseline = fitted.add_candidate("baseline", {});
  const auto distortion = fitted.add_candidate("distortion", {});
  fitted.selection.model = {vergence, focal};
  fitted.selection.not_testable = {unseen};
  fitted.add_cause(baseline, 1.0, 0.1, {vergence});
  fitted.add_cause(distortion, 9.0, 0.1, {focal});
  ASSERT_TRUE(fitted.drop());
  EXPECT_EQ(fitted.model.find("baseline", {}), nullptr);
  const auto* back = fitted.model.find("vergence", {});
  ASSERT_NE(back, nullptr);
  EXPECT_TRUE(back->parameters()[0].fitted);
  EXPECT_EQ(back->parameters()[0].value, 0.0);
  EXPECT_EQ(fitted.model.find("focal_length", {}), nullptr);  // the distortion still stands for it
  EXPECT_EQ(fitted.model.find("mesh_scale", {}), nullptr);
}

TEST(DropWeakest, LeavesOutNuisancesThatAnotherCauseReplaced) {
  Fitted fitted;
  const auto vergence = fitted.add_candidate("vergence", {}, true);
  const auto focal = fitted.add_candidate("focal_length", {}, true);
  fitted.add_cause(fitted.add_candidate("baseline", {}), 9.0, 0.1);
  fitted.selection.causes[0].replaced = {vergence, focal};
  fitted.add_cause(fitted.add_candidate("drift", {"elbow", ""}), 1.0, 0.1);
  ASSERT_TRUE(fitted.drop());
  EXPECT_EQ(fitted.model.find("drift", {"elbow", ""}), nullptr);
  EXPECT_EQ(fitted.model.find("vergence", {}), nullptr);
  EXPECT_EQ(fitted.model.find("focal_length", {}), nullptr);
}

}  // namespace
}  // namespace bodyschema::diagnosis
