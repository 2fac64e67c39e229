/* What the controller needs to know of its converter: @title@, ppafo @version@. */
#ifndef PPAFO_PLANT_H
#define PPAFO_PLANT_H

#define PLANT_PERIOD_US @period@u /* sample period of the controller */
#define PLANT_PRESSURE_STEP @pressure_step@ /* Pa for a count */
#define PLANT_TORQUE_STEP @torque_step@ /* N m for a count */
#define PLANT_TOP @top@ /* largest reading */
#define PLANT_MIDDLE @middle@ /* reading for a reference of 0 N m */

#endif
