#include "believed_outline.hpp"

#include <algorithm>
#include <cmath>

namespace bodyschema {

double believed_outline_sd_px(LogFit& fit, const State& state, const std::vector<bool>& left_out) {
  constexpr std::size_t kPictures = 12;
  OutlineSearch search{.search_px = 6.0, .spacing_px = 6.0, .robust_px = 3.0};
  for (const bool out : left_out) search.part_weight.push_back(out ? 0.0 : 1.0);
  const auto refs = state.refs();
  const auto coordinates = fit.moved_by(state.model(), refs);
  const LinearLog at = fit.predict(state.model(), coordinates);
  const auto directions = fit.directions(at, state.model(), refs);
  const Eigen::VectorXd sd = state.prior_sd();
  const auto pictures = fit.log().pictures();
  const std::size_t step = std::max<std::size_t>(1, pictures.size() / kPictures);
  OutlineEvidence expected;
  double sum = 0.0, weight = 0.0;
  for (std::size_t p = 0; p < pictures.size(); p += step) {
    fit.measurement().expect(pictures[p].joints.q, at.corrections[p], pictures[p].camera, coordinates, search,
                             expected);
    const double unit = fit.log().unit_px(p);
    for (Eigen::Index k = 0; k < state.size(); ++k) {
      Eigen::VectorXd direction = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(coordinates.size()));
      for (const auto& move : directions[p][static_cast<std::size_t>(k)]) {
        const auto found = std::find(coordinates.begin(), coordinates.end(), move.coordinate);
        if (found != coordinates.end()) direction[found - coordinates.begin()] = move.amount;
      }
      sum += sd[k] * sd[k] * direction.dot(expected.A * direction) / (unit * unit);
    }
    weight += expected.weight;
  }
  return weight > 0.0 ? std::sqrt(sum / weight) : 0.0;
}

}  // namespace bodyschema
