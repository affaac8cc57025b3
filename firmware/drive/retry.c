/* SPDX-License-Identifier: MIT */
#include "firmware/drive/retry.h"

void retry_withdraw(struct retry *r)
{
    r->wanted = false;
    r->waiting = false;
    r->due = false;
    r->resumes = false;
}

void retry_forget(struct retry *r)
{
    retry_withdraw(r);
    r->count = 0;
}

void retry_accept(struct retry *r)
{
    r->start_rpm_q16 = r->resumes ? r->resume_rpm_q16 : 0;
    r->resumes = false;
    r->due = false;
    r->wanted = true;
}
