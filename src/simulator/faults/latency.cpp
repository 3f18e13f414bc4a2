#include "kinds.hpp"

namespace bodyschema::simulator::faults {

/// The pictures arrive late and are stamped on arrival: a picture stamped t was taken at t - delay.
FaultKind latency() {
  FaultKind kind;
  kind.name = "latency";
  kind.parameter = "delay";
  kind.unit = "ms";
  kind.meaning = "positive: the image shows the past";
  kind.make = [](const FaultArguments& arguments, const FaultSite&) -> std::unique_ptr<Fault> {
    class Latency final : public Fault {
     public:
      explicit Latency(double delay_s) : delay_s_(delay_s) {}
      void expose(ExposureTiming& timing) override { timing.latency_s += delay_s_; }

     private:
      double delay_s_;
    };
    return std::make_unique<Latency>(1e-3 * arguments.number("value", -1000.0, 1000.0));
  };
  kind.targets = [](const FaultSite&) { return on_robot("latency", 5.0); };
  return kind;
}

}  // namespace bodyschema::simulator::faults
