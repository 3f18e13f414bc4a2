#include "next_steps.hpp"

namespace bodyschema::diagnosis {

std::vector<std::string> next_steps(const std::string& verdict, const LogDiagnosisOptions& options, bool has_motion) {
  const auto out = options.out.string(), log = options.log.string();
  const std::string config =
      " --config " + (options.configuration.empty() ? std::string("CONFIG") : options.configuration.string());
  const std::string both = "bodyschema diagnose " + log + " SECOND.log" + config + " --out " + out + "_both";
  std::vector<std::string> steps;
  if (verdict == "none") {
    steps.push_back("Nothing to extend. Apply the offsets: bodyschema replay " + log + config + " --out " + out +
                    "/replay, then bodyschema export.");
  }
  if (verdict == "unexplained") {
    steps.push_back(
        "Apply nothing. Look at the pictures and at what is left, mend what they show (masks, a held thing, meshes), "
        "or record another log and diagnose both: " +
        both);
  }
  if (verdict == "named" || verdict == "class") {
    const std::string extended = config + " --extended-model " + out + "/extended_model.yaml --out " + out;
    steps.push_back("See on a second log whether it holds: " + both);
    steps.push_back("Apply it: bodyschema replay " + log + extended + "/replay, then bodyschema export " + out +
                    "/replay/summary.json" + extended + "/apply");
  }
  if (has_motion) {
    steps.push_back("To tell the causes of the class apart, record the motion in " + out +
                    "/motion.csv (look at it first: bodyschema-sim --config SIMULATOR --motion " + out +
                    "/motion.csv --log seen.log --contact-sheet seen.png) and diagnose both logs");
  }
  return steps;
}

}  // namespace bodyschema::diagnosis
