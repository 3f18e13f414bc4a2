#include "kinds.hpp"

namespace bodyschema::simulator::faults {

/// The right camera opens its shutter later than its stamp says, the left one does not.
FaultKind camera_skew() {
  FaultKind kind;
  kind.name = "camera_skew";
  kind.parameter = "skew";
  kind.unit = "ms";
  kind.meaning = "positive: the right image is later than its stamp";
  kind.make = [](const FaultArguments& arguments, const FaultSite&) -> std::unique_ptr<Fault> {
    class CameraSkew final : public Fault {
     public:
      explicit CameraSkew(double skew_s) : skew_s_(skew_s) {}
      void expose(ExposureTiming& timing) override { timing.right_skew_s += skew_s_; }

     private:
      double skew_s_;
    };
    return std::make_unique<CameraSkew>(1e-3 * arguments.number("value", -1000.0, 1000.0));
  };
  kind.targets = [](const FaultSite& site) {
    return site.cameras < 2 ? std::vector<FaultTarget>{} : on_robot("camera_skew", 5.6);
  };
  return kind;
}

}  // namespace bodyschema::simulator::faults
