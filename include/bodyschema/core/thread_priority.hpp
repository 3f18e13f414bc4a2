#pragma once

namespace bodyschema {

/// Lets other threads go before the calling one: it leaves real-time scheduling, which it has from a service that was
/// started with it (chrt), where niceness means nothing, and becomes this nice.
/// @param nice  1 to 19; more gives way more
void give_way(int nice);

}  // namespace bodyschema
