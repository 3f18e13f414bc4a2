// What the diagnosis writes and the service reads.
#include "bodyschema/effects/error_model.hpp"
#include "effects/roles.hpp"
#include "fuzz.hpp"

using namespace bodyschema;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const JointRoles roles = test::roles();
  fuzz::refuse_or_accept([&] {
    ErrorModel model = ErrorModel::parse(std::string(fuzz::as_text(data, size)), roles);
    (void)model.to_yaml();
  });
  return 0;
}
