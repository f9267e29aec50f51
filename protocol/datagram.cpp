#include "protocol/datagram.hpp"
