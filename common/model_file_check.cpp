// common/model_file_check.cpp
#include "common/model_file_check.hpp"

#include <utility>

namespace ellicast::common {

PlainModelFile check_model_file(std::string bytes, ModelFormat format) {
    if (bytes.empty()) throw BadModelFile("empty");
    switch (format) {
        case ModelFormat::ply:
            return check_ply_file(std::move(bytes));
        case ModelFormat::obj:
            return check_obj_file(bytes);
        case ModelFormat::off:
            return check_off_file(bytes);
        case ModelFormat::stl:
            break;
    }
    return check_stl_file(std::move(bytes));
}

}  // namespace ellicast::common
