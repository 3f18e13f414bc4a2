#include "kinds.hpp"

namespace bodyschema::simulator::faults {

/// An encoder hangs: it goes on sending what it read last, to the bit, while the joint moves.
FaultKind stalled_encoder() {
  FaultKind kind;
  kind.name = "stalled_encoder";
  kind.parameter = "duration";
  kind.unit = "s";
  kind.meaning =
      "the reading does not change for this long (0: for good) from `at` seconds after the motion begins on "
      "(default: half-way)";
  kind.keys = {"joint", "at"};
  kind.in_catalogue = false;
  kind.one_sided = true;
  kind.make = [](const FaultArguments& arguments, const FaultSite& site) -> std::unique_ptr<Fault> {
    class StalledEncoder final : public Fault {
     public:
      explicit StalledEncoder(EncoderStall stall) : stall_(stall) {}
      void stall(std::vector<EncoderStall>& stalls) override { stalls.push_back(stall_); }

     private:
      EncoderStall stall_;
    };
    EncoderStall stall;
    stall.joint = arguments.joint();
    const double half = 0.5 * (site.end_s - site.begin_s);
    stall.begin_s = site.begin_s + arguments.number_or("at", half, 0.0, 1e6);
    const double duration = arguments.number_or("value", 0.0, 0.0, 1e6);
    stall.end_s = duration > 0.0 ? stall.begin_s + duration : 1e9;
    return std::make_unique<StalledEncoder>(stall);
  };
  kind.targets = nowhere;
  return kind;
}

}  // namespace bodyschema::simulator::faults
