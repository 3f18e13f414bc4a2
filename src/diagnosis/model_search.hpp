#pragma once

#include <algorithm>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "block_regression.hpp"
#include "bodyschema/diagnosis/diagnoser.hpp"
#include "candidates.hpp"

namespace bodyschema::diagnosis {

/// What a cause moves, root mean square over the log.
struct Size {
  double hand_m = 0.0, outline_px = 0.0;
  double outline_m = 0.0;  ///< at the hand's depth
  [[nodiscard]] double metres() const { return std::max(hand_m, outline_m); }
};

/// A cause that was found.
struct FoundCause {
  CauseName name;
  std::string variable;                        ///< of a free curve
  Microseconds from = 0;                       ///< of a slip
  double begin_s = 0.0, duration_s = 0.0;      ///< of a drift
  std::vector<std::vector<double>> amounts{};  ///< of a free curve
  std::size_t columns = 0;                     ///< how many parameters are fitted
  bool stated = false;                         ///< others saw it happen
  double gain = 0.0;                           ///< in held-out blocks, when it was taken in
  double room = 1.0;  ///< its largest plausible size, of the usual multiple of the typical one: what it is left to find
  [[nodiscard]] bool generic() const { return !variable.empty(); }
};

/// The model of a log as it grows: a state with beliefs, and the causes that were found.
class ModelSearch {
 public:
  ModelSearch(LogFit& fit, const std::vector<Belief>& beliefs, const std::vector<Belief>& tolerances,
              const DiagnosisOptions& options);

  /// About pictures that were linearised already, whose outlines may be gone: a cause that is added stands in the
  /// regression alone, and nothing is fitted anew.
  ModelSearch(LogFit& fit, State state, std::shared_ptr<const LinearLog> pictures, std::vector<OutlineNoise> noise,
              const std::vector<Belief>& tolerances, const DiagnosisOptions& options);

  /// Fits the state from all starts.
  void start();
  /// The log about the present model, in blocks of at least `block_s`.
  [[nodiscard]] LogAbout about(double block_s);
  [[nodiscard]] BlockRegression regression(const LogAbout& log) const;
  /// The state and all causes of the catalogue that were found, where a regression about the present model has them.
  [[nodiscard]] ErrorModel best(const BlockRegression& regression) const;

  /// A model that may take the place of the present one.
  struct Extended {
    std::vector<FoundCause> causes;
    State state;
    double cost = 0.0;
    std::vector<OutlineNoise> noise;
  };
  /// The present one with a cause more, fitted again; none: that is no better. Nothing changes yet.
  /// @param estimate  of the base's parameters (steps), then of the cause's columns
  std::optional<Extended> with(const FoundCause& cause, const Eigen::VectorXd& estimate, Eigen::Index base);
  /// Takes that cause in.
  void take(Extended extended);
  [[nodiscard]] Extended now() const { return {causes_, state_, cost_, noise_}; }
  void go_back_to(Extended before);
  /// Takes some causes out, by their positions.
  void drop(const std::vector<std::size_t>& out);
  /// Where a part of the log lies out of sight of the model: tries a slip of every joint there.
  void look_for_lost_part();

  /// Moves the state to where all pictures together have it: what a fit along a direction that is hardly told leaves.
  /// From now on steps and intervals go by the slope that is measured there.
  void polish(double block_s);

  [[nodiscard]] const State& state() const { return state_; }
  [[nodiscard]] const std::vector<FoundCause>& causes() const { return causes_; }
  /// Whether a cause that is added is fitted with all else.
  [[nodiscard]] bool refits() const { return !given_; }
  /// Whether a cause is in the state; others stand in the regression alone, at zero.
  [[nodiscard]] bool in_state(const FoundCause& cause) const { return !given_ && !cause.generic(); }
  [[nodiscard]] double cost() const { return cost_; }
  /// Positions of a cause's parameters in the base.
  [[nodiscard]] std::vector<Eigen::Index> columns_of(std::size_t cause) const;
  /// Positions of an effect's parameters in the state; empty: it is not estimated.
  [[nodiscard]] std::vector<Eigen::Index> columns_of(const CauseName& effect) const;
  [[nodiscard]] OutlineSearch search() const;
  [[nodiscard]] const std::vector<std::size_t>& raster() const { return raster_; }
  /// What a change of some columns and of the base's parameters moves.
  [[nodiscard]] Size size_of(const LogAbout& log, const std::vector<std::vector<Direction>>& columns,
                             const Eigen::VectorXd& amount, const Eigen::VectorXd& of_base);

 private:
  [[nodiscard]] State state_with(const std::vector<FoundCause>& causes) const;
  void add_causes(LogAbout& log) const;
  void add_considered(LogAbout& log) const;
  void group_blocks(LogAbout& log) const;
  /// Pictures of an arm that stands err alike, however many there are: together they count as those of one shortest
  /// block do, and as one picture at least.
  void count_postures_once(LogAbout& log) const;
  /// About the present model, all pictures, A times the slope; not anew while that stays what it is.
  std::shared_ptr<const LinearLog> linearised(std::span<const std::uint32_t> coordinates);
  double fit(State& state, double from_px);
  double fit(State& state, double from_px, std::span<const std::size_t> pictures);
  void measure_noise();
  /// How coordinates move the hand in one picture, and where it lies.
  struct HandInPicture {
    std::size_t picture = 0;
    Eigen::Matrix3Xd jacobian;
    double depth = 0.0;
  };
  /// In some pictures of the raster in which the arm is seen.
  const std::vector<HandInPicture>& hand_in(const LogAbout& log);

  LogFit& fit_;
  std::vector<Belief> beliefs_, tolerances_;
  const DiagnosisOptions& options_;
  std::shared_ptr<const LinearLog> given_;  ///< null: linearised anew whenever the state has changed
  std::vector<std::size_t> raster_;         ///< pictures that a fit looks at
  State state_;
  std::vector<FoundCause> causes_;
  std::vector<OutlineNoise> noise_;
  double cost_ = 0.0;
  double slope_ = 1.0;  ///< LogFit::slope, about the model that was polished last
  struct Polished {
    ErrorModel model;
    std::size_t causes = 0;  ///< those that are not in the model have columns beside it
    double block_s = 0.0;
  };
  std::optional<Polished> polished_;  ///< that one: it is as it should be
  struct Linearised {
    ErrorModel model;
    double robust_px = 0.0, slope = 1.0;
    std::shared_ptr<const LinearLog> at;
  };
  std::optional<Linearised> last_;
  std::shared_ptr<const LinearLog> hand_at_;  ///< what these are about: many sizes are asked of one log
  std::vector<HandInPicture> hand_;
};

}  // namespace bodyschema::diagnosis
