MODULE SpotWelding
  PROC body()
    SpotL wp31274_2,vmax,XQ11Gun,Sd_wp31274_2_20\QuickRelease,XQ11GunTCP\WObj:=wFML2_CabFrame;
    SpotL wp31154,vmax,XQ11Gun,Sd_wp31154_20,\QuickRelease,XQ11GunTCP\WObj:=wFML2_CabFrame;
    SpotL p1,v100,spot1\InPos\NoConc\Retract,gun1,tool1\WObj:=wobj1;
    SpotJ p1\ID:=7,v100,gun1\GunD:=gd1,spot1\OpenHLift,tool1;
    SpotML p1,v100\G1:=sd1\G2:=sd2,\InPos,tool1\WObj:=wobj1\TLoad:=load1;
    SpotMJ p1,v100,\G1:=sd1,tool1;
    SetForce gun1,force1\RetThickness:=t;
    CalibL p1,v10,gun1\TipChg,fine,tool1\WObj:=wobj1;
    Soldar\AbrirTotal;
  ENDPROC
ENDMODULE
