#include "bodyschema/estimator/pull_judge.hpp"

namespace bodyschema {
namespace {

// Pulls, chi-square; where they come from is said in the header.
constexpr double kSurprise = 400.0;  // 20 sd in one direction: contradicts, whatever is usual
constexpr double kDoubt = 80.0;      // 9 sd in one direction: a smaller pull is never doubted ...
constexpr double kDoubtRatio = 8.0;  // ... nor one of fewer times the usual
constexpr double kUsualFrames = 30.0;

}  // namespace

PullJudge::Verdict PullJudge::judge(double pull) {
  const bool doubtful = pull > kDoubt && pull > kDoubtRatio * usual_;
  doubtful_frames_ = doubtful ? doubtful_frames_ + 1 : 0;
  if (pull >= kSurprise || doubtful_frames_ > 1) return Verdict::kContradicts;
  if (doubtful) return Verdict::kDoubtful;
  usual_ += (pull - usual_) / kUsualFrames;
  return Verdict::kAgrees;
}

void PullJudge::forget() {
  *this = {};
}

}  // namespace bodyschema
