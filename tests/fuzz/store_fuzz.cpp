// Two pages of the parameter store with anything in them. Input: a byte whose bits 0 and 1 ask for an honest
// end of the first and second page, so that more than the check is reached, then the words of both pages in
// turn.
#include <array>
#include <cstdlib>
#include <cstring>

#include "tests/fuzz/exercise.h"

extern "C" {
#include "firmware/params/store.h"
}

namespace
{

using Page = std::array<uint32_t, STORE_WORDS>;

void must(bool holds)
{
    if (!holds) {
        std::abort();
    }
}

// As written by the firmware: header and pairs that stand there, and the end that belongs to them.
void finish(Page &page)
{
    const Page given = page;
    const uint32_t count = given[3] % (STORE_PAIRS_MAX + 1U);
    store_writer_t writer;
    store_begin(&writer, given[1], given[2], count, page.data());
    uint32_t at = STORE_HEADER;
    for (uint32_t n = 0; n < count; ++n, at += 2) {
        store_put(&writer, {given[at], static_cast<int32_t>(given[at + 1])}, &page[at]);
    }
    store_end(&writer, &page[at]);
    must(store_check(page.data()) == static_cast<int32_t>(count));
}

void look(const Page &page)
{
    const int32_t count = store_check(page.data());
    must(count <= static_cast<int32_t>(STORE_PAIRS_MAX));
    for (int32_t n = 0; n < count; ++n) {
        const store_pair_t pair = store_pair(page.data(), static_cast<uint32_t>(n));
        int32_t value = 0;
        must(store_find(page.data(), pair.id, &value));
    }
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    std::array<Page, 2> page;
    for (Page &p : page) {
        p.fill(UINT32_MAX);
    }
    const uint8_t honest = size > 0 ? data[0] : 0;
    for (size_t n = 0; 4 * n + 4 < size && n < 2 * STORE_WORDS; ++n) {
        std::memcpy(&page[n % 2][n / 2], data + 1 + 4 * n, 4);
    }
    for (size_t n = 0; n < 2; ++n) {
        if ((honest >> n & 1) != 0) {
            finish(page[n]);
        }
        look(page[n]);
    }
    const int32_t newest = store_newest(page[0].data(), page[1].data());
    must(newest >= -1 && newest <= 1);
    must(newest < 0 || store_check(page[size_t(newest)].data()) >= 0);
    must(newest >= 0 || (store_check(page[0].data()) < 0 && store_check(page[1].data()) < 0));
    return 0;
}
